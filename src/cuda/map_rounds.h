#pragma once

#include <functional>

#include "cuda/light_maps.h"
#include "cuda/packet_cut.h"

namespace lightcuts::cuda {

/// Parts of a picture: those named (in the device's memory), or, where `units` is null, the first `count`.
struct UnitList {
  const std::uint32_t* units = nullptr;
  std::uint32_t count = 0;
};

/// Lights units with the maps that there are. A unit that misses a map marks it as wanted, goes to `missed`, and is
/// left as it was. Returns false to stop.
using LightUnits = std::function<bool(const UnitList& units, const MissedList& missed)>;

/// Looks up the lights ids[0 .. count) of a kind, which have maps, from all pixels of a unit's tile; see look_up_tile.
using LookUpUnit = std::function<void(std::uint32_t unit, int kind, const std::uint32_t* ids, std::uint32_t count,
                                      std::uint8_t* shares)>;

/// What is done with units.
struct UnitWork {
  LightUnits light;
  LookUpUnit look_up;
  /// Marks about those lights as wanted that the units will want, for less than it takes to light them; false to stop.
  /// May be nothing.
  std::function<bool(const UnitList& units)> ask = {};
};

/// Lights all units of a picture by shadow maps that are made for those lights only that represent a node of some
/// pixel's cut: so the memory bounds neither the number of lights nor the size of the picture.
///
/// In rounds: where there are hardly any maps, all units ask for what they will want; all units are lit, maps are made
/// for the lights that any of them missed, and the units that missed one are lit again, until none misses any: what is
/// kept of a unit has seen every light of its cuts through its map, so that the promise holds against the shadowed
/// total, and the picture does not depend on which maps there were. The upper levels' lights, from which a pixel's
/// total is guessed, have maps from the start, and so have all where they are few. Where not all maps fit into the
/// memory at once, units are lit in batches; and where those of a single unit do not, what its lights leave at its
/// pixels is looked up some maps at a time and remembered instead, a byte a pixel.
/// @param units_of_tile  numbers of units that a tile has, whether they exist or not: its groups, or its pixels
/// `go_on(done)`, done in [0, 1], is asked between rounds; returns false where it said stop. `rounds` receives how many
/// there were. Throws Error{out_of_memory} where not even that fits.
bool light_in_rounds(Device& device, LightMaps& maps, const TreeViews& trees, const UnitList& all,
                     std::uint32_t units_of_tile, const UnitWork& work, const std::function<bool(double)>& go_on,
                     std::uint64_t& rounds);

}  // namespace lightcuts::cuda
