// The text of the shadow map kernels, included once by each ism_kernels_ISA.cpp, which defines LC_ISA.
// No include guard on purpose.

#include "cpu/cut/node_lanes.h"
#include "cpu/simd/ism_kernels.h"
#include "cpu/simd/lanes.h"

namespace lightcuts::LC_ISA {

/// Found by its argument's type, so not in the unnamed namespace.
LC_LANES_FN Lanes inverse_facing(Lanes v) { return quick_reciprocal(away_from_zero(v)); }

namespace {

using LanesVec3 = Vec3T<Lanes>;

LC_LANES_FN LanesVec3 broadcast(const Vec3& v) { return {Lanes(v.x), Lanes(v.y), Lanes(v.z)}; }

LC_LANES_FN LanesVec3 load(const PacketVec3& v, int first) {
  return {Lanes::load(v.x + first), Lanes::load(v.y + first), Lanes::load(v.z + first)};
}

LC_LANES_FN Lanes load_unaligned(const float* from) { return Batch::load_unaligned(from); }

LC_LANES_FN LanesVec3 load_unaligned(const float* x, const float* y, const float* z, std::size_t first) {
  return {load_unaligned(x + first), load_unaligned(y + first), load_unaligned(z + first)};
}

}  // namespace
}  // namespace lightcuts::LC_ISA

#include "cpu/simd/ism_draw_body.h"
#include "cpu/simd/ism_group_lookup_body.h"
#include "cpu/simd/ism_lookup_body.h"

namespace lightcuts::LC_ISA {

extern const IsmKernels ism_kernels;
const IsmKernels ism_kernels{draw, encode16, encode32, look_up, look_up_group};

}  // namespace lightcuts::LC_ISA
