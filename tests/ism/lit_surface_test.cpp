#include <gtest/gtest.h>

#include "cpu_shade/random_packet.h"
#include "ism/map_scene.h"
#include "oracle/shadow_map_agreement.h"

namespace lightcuts {
namespace {

/// Where the depth lies that a map holds in the texel of a receiver.
Vec3 stored_place(const ShadowMapSet& maps, const MapView& view, std::uint32_t light, Vec3 receiver) {
  const int size = maps.maker().options().size;
  const MapPoint<float> at = project_paraboloid(to_local_point(view, receiver));
  const auto texel = [size](float u) {
    return std::clamp(static_cast<int>((u + 1) * 0.5f * static_cast<float>(size)), 0, size - 1);
  };
  const int x = texel(at.u), y = texel(at.v);
  const std::uint32_t code = maps.codes_of(LightKind::vpl, light)[static_cast<std::size_t>(y * size + x)];
  const Vec3 w = to_world(view.frame, unproject_paraboloid(texel_centre(x, size), texel_centre(y, size)));
  return view.origin + w * (static_cast<float>(code) * view.far / kDepthSteps<std::uint16_t>);
}

/// Share of receivers that are lit, of those that a light reaches with no shadow's edge near. Dark ones count where a
/// surface shadows itself (acne): where what hides them lies within a texel's width of their own plane. What is hidden by
/// discs that reach beyond a slender thing's outline is not counted.
double lit_share(const MapScene& s, const ShadowMapSet& maps, std::size_t step, int per_light) {
  oracle::ReceiverSampler sampler(s.cpu_scene.view(), 3);
  double asked = 0, passed = 0;
  for (std::size_t light = 0; light < s.light_set.vpls.size(); light += step) {
    const auto id = static_cast<std::uint32_t>(light);
    const Vpl& vpl = s.light_set.vpls[light];
    const MapView view = maps.view_of(LightKind::vpl, id);
    for (int found = 0, tries = 0; found < per_light && tries < 60 * per_light; ++tries) {
      const auto p = sampler.draw();
      const Vec3 to_light = offset_point(vpl.position, vpl.axis) - p.position;
      if (dot(to_light, vpl.axis) >= -0.05f * length(to_light) || dot(to_light, p.normal) <= 0.05f * length(to_light)) {
        continue;
      }
      if (s.tracer.occluded(shadow_ray(p.position, offset_point(vpl.position, vpl.axis)))) continue;
      if (oracle::at_shadow_edge(s.tracer, view, maps.maker().options().size, p.position, p.normal, true)) continue;
      ReceiverPacket packet{};
      set_lane(packet.position, 0, p.position);
      set_lane(packet.ng, 0, p.normal);
      alignas(64) float share[kPacketSize];
      maps.shares(LightKind::vpl, id, packet, 1, share);
      ++found;
      asked += 1;
      const float width = 4 * length(to_light) / static_cast<float>(maps.maker().options().size);
      const bool by_itself = std::abs(dot(p.normal, stored_place(maps, view, id, p.position) - p.position)) < width;
      passed += by_itself ? share[0] : 1;
    }
  }
  EXPECT_GT(asked, 200);
  return passed / asked;
}

class LitSurfaceTest : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Scenes, LitSurfaceTest, testing::Values("study", "cornell", "furnace"));

TEST_P(LitSurfaceTest, IsFreeOfAcneAtAllMapSizes) {
  MapScene s(make_builtin_scene(GetParam()));
  s.trace(600);
  constexpr std::size_t step = 25;
  for (const int size : {16, 32, 64, 128, 256}) {
    ShadowMapOptions options;
    options.size = size;
    const Maps maps(s, 8000, options, every_light(s.light_set, 0, step));
    const double share = lit_share(s, maps.set, step, 60);
    EXPECT_GE(share, size < 32 ? 0.98 : 0.99) << size << " texels";
  }
}

}  // namespace
}  // namespace lightcuts
