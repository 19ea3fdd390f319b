#include <gtest/gtest.h>

#include "cpu/simd/isa.h"
#include "cut/cut_scene.h"

namespace lightcuts::test {
namespace {

/// Whether a rectangle in the plane y = 0.1 is between two points.
bool is_blocked(Vec3 from, Vec3 to) {
  const double before = double(from.y) - 0.1, behind = 0.1 - double(to.y);
  if (before * behind <= 0) return false;
  const double t = before / (before + behind);
  const double x = from.x + t * (double(to.x) - from.x), z = from.z + t * (double(to.z) - from.z);
  return std::abs(x) < 0.9 && std::abs(z) < 0.7;
}

/// What arrives past the rectangle, with as little machinery as can be.
class PastRectangle final : public PacketVisibility {
 public:
  explicit PastRectangle(const Lights& lights) : lights_(lights) {}
  std::uint32_t shares(const VisibilityQuery& query, float* share) const override {
    for (int lane = 0; lane < kPacketSize; ++lane) {
      const bool asks = (query.candidates >> lane & 1u) != 0;
      const Vec3 from = get_lane(query.receivers.position, lane);
      share[lane] = asks && !is_blocked(from, lights_.vpls[query.light].position) ? 1.0f : 0.0f;
    }
    return static_cast<std::uint32_t>(std::popcount(query.candidates));
  }

 private:
  const Lights& lights_;
};

/// Total of a cut of VPLs, with shadows, in double precision; luminance times pi.
double shadowed_total(const CutScene& scene, const std::vector<std::uint32_t>& cut, const CheckedPoint& p) {
  double total = 0;
  for (const std::uint32_t index : cut) {
    const LightNode& node = scene.trees.vpls.nodes[index];
    if (is_blocked(p.position, scene.lights.vpls[node.representative].position)) continue;
    total += luminance_of(p.albedo, node.intensity) * oracle_factor(scene.lights, 0, node.representative, p);
  }
  return total;
}

TEST(ShadowedCut, BothWaysKeepTheirPromiseAgainstTheShadowedTotal) {
  Dice dice(21);
  double shadowed = 0, unshadowed = 0;
  for (const float error : {0.1f, 0.02f, 0.003f}) {
    CutScene scene(mixed_lights(1, 900, 0, 0), error);
    const PastRectangle visibility(scene.lights);
    scene.context.visibility = &visibility;
    for (int i = 0; i < 4; ++i) {
      const SurfacePacket packet = i % 2 == 0 ? random_surfaces(dice) : coherent_surfaces(dice, 0.05f, i == 3);
      CutCollector collector;
      const TileLight lit = packet_cut_of(scene, packet, collector, selected_isa());
      for (int lane = 0; lane < kPacketSize; ++lane) {
        const CheckedPoint point = point_of(packet, lane, scene);
        const std::vector<std::uint32_t>& nodes = collector.cuts[lane][0];
        ASSERT_TRUE(holds_each_light_once(scene.trees.vpls, nodes));
        const DoubleCheck check = check_lane(scene, packet, collector, lane);
        const double total = shadowed_total(scene, nodes, point);
        EXPECT_NEAR(total_of(lit, packet, lane), total, 1e-5 * check.total);
        EXPECT_LE(check.largest, error * total);

        const CutNodes heap = nodes_of(heap_cut_of(scene, packet, lane));
        ASSERT_TRUE(holds_each_light_once(scene.trees.vpls, heap[0]));
        const DoubleCheck heap_check = check_again(scene.lights, scene.trees, heap, point);
        EXPECT_LE(heap_check.largest, error * shadowed_total(scene, heap[0], point));
        shadowed += total;
        unshadowed += check.total;
      }
    }
  }
  EXPECT_LT(shadowed, 0.9 * unshadowed);  // else nothing was shown
  EXPECT_GT(shadowed, 0.2 * unshadowed);
}

}  // namespace
}  // namespace lightcuts::test
