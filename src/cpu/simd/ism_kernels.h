#pragma once

#include <cstddef>
#include <cstdint>

#include "cpu/simd/packet.h"
#include "kernels/shadow_map.h"

namespace lightcuts {

/// Points of surfaces side by side. Arrays may be read 16 entries past the last one in use.
struct PointArrays {
  const float *x, *y, *z;                       ///< [m]
  const float *normal_x, *normal_y, *normal_z;  ///< unit, either side
  const std::uint32_t* shape;                   ///< which entry of `shapes` a point has
  const DiscShape* shapes;
};

/// A map's depth codes: 16 or 32 bits each, row by row. Two bytes past the last code may be read.
struct DepthCodes {
  const void* codes;
  int size;  ///< texels a side
  int depth_bits;
};

/// The inner loops of imperfect shadow maps, compiled once for each instruction set.
struct IsmKernels {
  /// Draws points `first` to `first + count` as discs into `depths` [m], which keeps the nearest.
  ///
  /// Every texel whose centre ray meets a disc gets the depth of the meeting point, so that the map holds the surface
  /// itself and not discs that face the light. Rows are `size` floats, 16 more after the last row may be written (with
  /// what they hold).
  void (*draw)(const PointArrays&, std::size_t first, std::size_t count, const MapView&, int size, float* depths);

  /// Turns depths [m] into codes; infinite ones into "nothing was drawn".
  void (*encode16)(const float* depths, std::size_t count, float steps_per_metre, std::uint16_t* codes);
  void (*encode32)(const float* depths, std::size_t count, float steps_per_metre, std::uint32_t* codes);

  /// Share of light that arrives at each of 16 receivers by lookup_visibility; `share` is aligned to 64 bytes.
  void (*look_up)(const ReceiverPacket&, const MapView&, const DepthCodes&, float* share);
};

enum class Isa;

/// The kernels of an instruction set that this machine runs.
const IsmKernels& ism_kernels(Isa isa);

}  // namespace lightcuts
