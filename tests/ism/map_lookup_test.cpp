#include "kernels/map_lookup.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <random>
#include <vector>

namespace lightcuts {
namespace {

Vec3 random_direction(std::mt19937& dice) {
  std::normal_distribution<float> normal;
  return normalize(Vec3{normal(dice), normal(dice), normal(dice)});
}

/// Random maps, and receivers on planes through random places: the lookup of threads against the one by definition.
template <class Depth, bool Paraboloid, int Size>
void compare_lookups(int size) {
  std::mt19937 dice(static_cast<unsigned>(size) + sizeof(Depth));
  std::uniform_real_distribution<float> unit(0, 1);
  const Box bounds{{-3, -1, -4}, {5, 3, 4}};
  int receivers = 0, differ = 0, facing_differ = 0, at_border = 0;
  double passed = 0;
  for (int round = 0; round < 200; ++round) {
    const Vec3 origin = bounds.lo + (bounds.hi - bounds.lo) * Vec3{unit(dice), unit(dice), unit(dice)};
    const Vec3 axis = random_direction(dice);
    const MapView view = Paraboloid ? paraboloid_view(origin, axis, bounds) : orthographic_view(axis, bounds);
    const MapRecord map = make_map_record<Depth>(view, size);
    std::vector<Depth> codes(static_cast<std::size_t>(size * size));
    for (Depth& code : codes) {
      code = unit(dice) < 0.2f ? kNoDepth<Depth> : static_cast<Depth>(unit(dice) * 0.6f * kDepthSteps<Depth>);
    }
    for (int i = 0; i < 200; ++i) {
      const Vec3 at = bounds.lo + (bounds.hi - bounds.lo) * Vec3{unit(dice), unit(dice), unit(dice)};
      const Vec3 ng = random_direction(dice);
      const Vec3 local = to_local_point(view, at);
      if (Paraboloid && !(local.z > 0)) continue;
      const auto fetch = [&](int x, int y) { return codes[static_cast<std::size_t>(y * size + x)]; };
      const float expected = lookup_visibility<Depth>(view, local, to_local_vector(view.frame, ng), size, fetch);
      const float got = look_up_map<Depth, Paraboloid, Size>(map, to_map(map, at), ng, size, codes.data());
      if constexpr (Paraboloid) {
        // The loops over lights turn the normal away from the light before they ask.
        const Vec3 seen = to_map(map, at), turned = dot(ng, at - origin) < 0 ? -ng : ng;
        const Vec3 normal{dot(turned, map.x), dot(turned, map.y), dot(turned, map.z)};
        const float facing =
            look_up_facing<Depth, Size>(map, seen, normal, dot(seen, seen), dot(seen, normal), size, codes.data());
        facing_differ += std::abs(facing - expected) > 1e-5f ? 1 : 0;
      }
      ++receivers;
      passed += expected;
      differ += std::abs(got - expected) > 1e-5f ? 1 : 0;
      at_border += std::abs(local.x) > 0.8f * local.z + length(local) ? 1 : 0;
    }
  }
  std::printf("  %d texels, %d bits: %d of %d lookups differ, %.0f %% pass\n", size,
              static_cast<int>(8 * sizeof(Depth)), differ, receivers, 100 * passed / receivers);
  EXPECT_LE(differ, receivers / 500);  // a tap on the edge of a texel or of a depth code
  EXPECT_LE(facing_differ, receivers / 500);
  EXPECT_GT(passed, 0.1 * receivers);
  EXPECT_LT(passed, 0.9 * receivers);
}

TEST(MapLookup, AgreesWithTheDefinition) {
  for (const int size : {4, 32, 128}) {
    compare_lookups<std::uint16_t, true, 0>(size);
    compare_lookups<std::uint32_t, true, 0>(size);
    compare_lookups<std::uint16_t, false, 0>(size);
    compare_lookups<std::uint32_t, false, 0>(size);
  }
  compare_lookups<std::uint16_t, true, 32>(32);
  compare_lookups<std::uint16_t, true, 64>(64);
}

TEST(MapLookup, WithoutADepthEverythingPasses) {
  const Box bounds{{-1, -1, -1}, {1, 1, 1}};
  const MapView view = paraboloid_view({0, 0, -1}, {0, 0, 1}, bounds);
  const MapRecord map = make_map_record<std::uint16_t>(view, 16);
  const std::vector<std::uint16_t> empty(256, kNoDepth<std::uint16_t>);
  // The farthest corner, in every direction that its surface may face.
  for (const Vec3 ng : {Vec3{0, 0, -1}, normalize(Vec3{-1, -1, -1}), Vec3{-1, 0, 0}}) {
    EXPECT_EQ((look_up_map<std::uint16_t, true>(map, to_map(map, {1, 1, 1}), ng, 16, empty.data())), 1.0f);
  }
}

}  // namespace
}  // namespace lightcuts
