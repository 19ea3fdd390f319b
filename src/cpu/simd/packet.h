#pragma once

#include <cstdint>

#include "lightcuts/math.h"
#include "lightcuts/vpl.h"

namespace lightcuts {

// Plain data that the SIMD kernels share with the rest of src/cpu. No member functions: files of every instruction set
// include this.

inline constexpr int kPacketSize = 16;  ///< pixels a packet, whatever the registers' width
inline constexpr int kPacketSide = 4;   ///< a packet is a square of pixels: its rays stay close together

/// Three numbers a pixel.
struct alignas(64) PacketVec3 {
  float x[kPacketSize];
  float y[kPacketSize];
  float z[kPacketSize];
};

/// Sixteen points of surfaces that receive light; pixels that see none have zero normals, so that nothing lights them.
struct alignas(64) ReceiverPacket {
  PacketVec3 position;       ///< [m], world space, off the surface by its rounding error: shadow rays start here
  PacketVec3 ns;             ///< unit shading normals, on the viewer's side
  PacketVec3 ng;             ///< unit geometric normals, on the viewer's side
  std::uint32_t active = 0;  ///< bit i: pixel i sees a surface
  bool flat = false;         ///< ns == ng in every pixel: a faster kernel serves
};

/// A point or spot light ready for the inner loop; see PointLight.
struct PointRecord {
  Vec3 position;
  Vec3 axis;
  Vec3 intensity;
  float cos_outer;
  float inverse_range;
};

/// A directional light; see DirectionalLight. (Nothing of scene.h and its containers comes into the kernels' files.)
struct DirectionalRecord {
  Vec3 direction;
  Vec3 irradiance;
};

/// Sum of light over the receivers of a packet: factor times intensity [W/m^2], albedo / pi still to come.
struct alignas(64) PacketSum {
  PacketVec3 light;
  float lost[kPacketSize];  ///< luminance that the clamp of the VPL distance took
};

/// What one light does to each receiver of a packet, before visibility.
struct alignas(64) PacketFactors {
  float clamped[kPacketSize];
  float unclamped[kPacketSize];
};

}  // namespace lightcuts
