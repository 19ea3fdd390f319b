#include "cpu/visibility.h"

#include "cpu/ray_tracer.h"

namespace lightcuts {

std::uint32_t RayVisibility::shares(const VisibilityQuery& query, float* share) const {
  const std::uint32_t visible = query.candidates & ~tracer_.occluded16(query.rays, query.candidates);
  for (int lane = 0; lane < kPacketSize; ++lane) share[lane] = static_cast<float>((visible >> lane) & 1u);
  return static_cast<std::uint32_t>(std::popcount(query.candidates));
}

}  // namespace lightcuts
