#pragma once

#include <cstddef>
#include <cstdint>

#include "cpu/simd/packet.h"
#include "kernels/group_lookup.h"
#include "kernels/map_lookup.h"
#include "kernels/shadow_map.h"

namespace lightcuts {

/// Points of surfaces side by side. Arrays may be read 16 entries past the last one in use.
struct PointArrays {
  const float *x, *y, *z;                       ///< [m]
  const float *normal_x, *normal_y, *normal_z;  ///< unit, either side
  const float *sink_in_front, *sink_behind;     ///< see pack_sink [m]
  const std::uint32_t* shape;                   ///< which entry of `shapes` a point has
  const DiscShape* shapes;
};

/// A map's depth codes: 16 or 32 bits each, row by row. Eight bytes before the first and past the last may be read.
struct DepthCodes {
  const void* codes;
  int size;  ///< texels a side
  int depth_bits;
};

/// A map that a group asks.
struct GroupMap {
  const MapRecord* record;
  const std::uint16_t* codes;
};

/// Floats from one row of a map being drawn to the next: whole registers.
constexpr std::size_t nearness_stride(int size) { return (static_cast<std::size_t>(size) + 15) / 16 * 16; }

/// Floats that a map being drawn takes; one row is spare.
constexpr std::size_t nearness_floats(int size) { return static_cast<std::size_t>(size + 1) * nearness_stride(size); }

/// The inner loops of imperfect shadow maps, compiled once for each instruction set.
struct IsmKernels {
  /// Draws points `first` to `first + count` as discs into `nearness`, which keeps the nearest.
  ///
  /// Every texel whose centre ray meets a disc gets the nearness (kernels/shadow_map.h) of the meeting point, so that the
  /// map holds the surface itself and not discs that face the light; 0 is nothing. Takes nearness_floats(size), aligned to 64
  /// bytes; what is written past the last texel of a row or column means nothing.
  void (*draw)(const PointArrays&, std::size_t first, std::size_t count, const MapView&, int size, float* nearness);

  /// Turns a drawn map into codes, row by row without gaps; texels with nothing, or beyond the view's rim, into kNoDepth.
  void (*encode16)(const float* nearness, const MapView&, int size, std::uint16_t* codes);
  void (*encode32)(const float* nearness, const MapView&, int size, std::uint32_t* codes);

  /// Share of light that arrives at each of 16 receivers as look_up_map of kernels/map_lookup.h says; 0 for those that
  /// are no candidates. `share` is aligned to 64 bytes.
  void (*look_up)(const ReceiverPacket&, std::uint32_t candidates, const MapRecord&, const DepthCodes&, float* share);

  /// One look at each of up to 16 paraboloid maps of 16-bit depths for a flat group of receivers: look_up_group of
  /// kernels/group_lookup.h, kEachItsOwn where it cannot say. `share` is aligned to 64 bytes.
  void (*look_up_group)(const FlatReceivers&, const GroupMap* maps, int count, int size, float* share);
};

enum class Isa;

/// The kernels of an instruction set that this machine runs.
const IsmKernels& ism_kernels(Isa isa);

}  // namespace lightcuts
