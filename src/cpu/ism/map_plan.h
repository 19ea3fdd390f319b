#pragma once

#include <cstddef>
#include <cstdint>

#include "cpu/ism/shadow_map_set.h"
#include "cpu/ism/surface_points.h"

namespace lightcuts {

/// Into how many batches the lights of a picture are divided, so that the maps of one batch fit.
struct MapPlan {
  std::size_t batches = 1;
  std::uint64_t maps = 0;  ///< of all batches together
  bool keeps_all = false;  ///< the maps of all batches fit, and are few enough to be kept for the next picture
};

/// Plans before memory is taken. Batch b has every `batches`-th light from the b-th on.
///
/// A batch is kept small enough for the processor's caches even where memory is plenty: tracing the camera's rays again is
/// cheaper than reading each map from memory for each tile.
/// @param budget  bytes for points and maps, 0: no limit
/// Throws Error{out_of_memory} where not even a small batch fits.
MapPlan plan_maps(const LightSet& lights, const PointOptions& points, const ShadowMapOptions& maps,
                  std::uint64_t budget);

/// For how many maps there is room at a time, where any light's may be asked for: never more than all lights have, and two
/// for each thread at least. Where the maps that cuts ask for are more, they are made in rounds.
/// Throws Error{out_of_memory} where not even that fits.
std::size_t plan_pool(const LightSet& lights, const PointOptions& points, const ShadowMapOptions& maps, int threads,
                      std::uint64_t budget);

}  // namespace lightcuts
