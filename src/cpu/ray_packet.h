#pragma once

namespace lightcuts {

/// Rays side by side, as Embree and SIMD code want them. Directions need not be unit length.
template <int N>
struct alignas(4 * N) RayPacket {
  float ox[N], oy[N], oz[N], t_min[N];
  float dx[N], dy[N], dz[N], t_max[N];
};
using RayPacket4 = RayPacket<4>;
using RayPacket8 = RayPacket<8>;
using RayPacket16 = RayPacket<16>;

}  // namespace lightcuts
