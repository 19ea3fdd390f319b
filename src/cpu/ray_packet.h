#pragma once

#include "lightcuts/math.h"

namespace lightcuts {

/// Rays side by side, as Embree and SIMD code want them. Directions need not be unit length.
template <int N>
struct alignas(4 * N) RayPacket {
  float ox[N], oy[N], oz[N], t_min[N];
  float dx[N], dy[N], dz[N], t_max[N];

  /// From t = 0 on.
  void set(int lane, Vec3 origin, Vec3 direction, float end) {
    ox[lane] = origin.x, oy[lane] = origin.y, oz[lane] = origin.z;
    dx[lane] = direction.x, dy[lane] = direction.y, dz[lane] = direction.z;
    t_min[lane] = 0, t_max[lane] = end;
  }
};
using RayPacket4 = RayPacket<4>;
using RayPacket8 = RayPacket<8>;
using RayPacket16 = RayPacket<16>;

}  // namespace lightcuts
