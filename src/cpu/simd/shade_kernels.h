#pragma once

#include <cstddef>
#include <cstdint>

#include "cpu/ray_packet.h"
#include "cpu/simd/packet.h"

namespace lightcuts {

/// The inner loops of shading, compiled once for each instruction set.
///
/// `sum_*` add nothing to what `sum` holds: they set it to the sum over `count` lights, no visibility, so that the caller
/// adds blocks of lights in double precision. `*_shadow_rays` prepare one light: they return the lanes that it could
/// light (bits), with the factor of each and the rays that decide. `accumulate` then adds the light where it arrives.
struct ShadeKernels {
  const char* name;
  int lanes;  ///< pixels in one register

  /// True if some receiver is nearer to some light than the clamp: then sum_vpl_loss has something to say.
  bool (*sum_vpls)(const ReceiverPacket&, const Vpl* vpls, std::size_t count, float min_distance_sq, PacketSum& sum);
  /// Sets only sum.lost: the luminance that the clamp took.
  void (*sum_vpl_loss)(const ReceiverPacket&, const Vpl* vpls, std::size_t count, float min_distance_sq,
                       PacketSum& sum);
  void (*sum_points)(const ReceiverPacket&, const PointRecord* points, std::size_t count, PacketSum& sum);
  void (*sum_directionals)(const ReceiverPacket&, const DirectionalRecord* lights, std::size_t count, PacketSum& sum);

  std::uint32_t (*vpl_shadow_rays)(const ReceiverPacket&, const Vpl&, float min_distance_sq, PacketFactors&,
                                   RayPacket16&);
  std::uint32_t (*point_shadow_rays)(const ReceiverPacket&, const PointRecord&, PacketFactors&, RayPacket16&);
  std::uint32_t (*directional_shadow_rays)(const ReceiverPacket&, const DirectionalRecord&, PacketFactors&,
                                           RayPacket16&);

  /// Adds share * factor * intensity to sum.light, and what the clamp took to sum.lost; `share` [0, 1] is how much of
  /// the light arrives at each of 16 receivers, aligned to 64 bytes.
  void (*accumulate)(const PacketFactors&, Vec3 intensity, const float* share, PacketSum& sum);
};

enum class Isa;  // isa.h, which needs containers that the kernels' own files must not see

/// The kernels of an instruction set that this machine runs.
const ShadeKernels& shade_kernels(Isa isa);

}  // namespace lightcuts
