#include <gtest/gtest.h>

#include "cpu/simd/isa.h"
#include "cpu/simd/ism_kernels.h"
#include "cpu_shade/random_packet.h"
#include "kernels/shadow_map.h"

namespace lightcuts {
namespace {

TEST(ShadowMapFormulas, ProjectionsAreUndone) {
  Dice dice(1);
  for (int i = 0; i < 1000; ++i) {
    Vec3 w = dice.direction();
    if (w.z < 0) w.z = -w.z;
    const MapPoint<float> p = project_paraboloid(w * 3.0f);
    EXPECT_NEAR(p.depth, 3, 1e-5);
    EXPECT_LE(p.u * p.u + p.v * p.v, 1 + 1e-5);
    const Vec3 back = unproject_paraboloid(p.u, p.v);
    EXPECT_NEAR(length(back - w), 0, 1e-5);
  }
}

TEST(ShadowMapFormulas, KnownPlacesOfTheParaboloid) {
  // Straight ahead: the middle. On the horizon: the rim. 45 degrees: tan(22.5 degrees).
  EXPECT_FLOAT_EQ(project_paraboloid(Vec3{0, 0, 2}).u, 0);
  EXPECT_FLOAT_EQ(project_paraboloid(Vec3{5, 0, 0}).u, 1);
  EXPECT_NEAR(project_paraboloid(Vec3{0, 1, 1}).v, 0.41421356, 1e-6);
}

TEST(ShadowMapFormulas, TheFootprintHoldsTheDiscAndNotMuchMore) {
  Dice dice(2);
  for (int i = 0; i < 300; ++i) {
    const Vec3 centre = dice.direction() * dice.between(0.5f, 3);
    if (centre.z < 0.1f) continue;
    const float radius = 0.4f;
    const Footprint<float> print = paraboloid_footprint(centre, radius);
    float farthest = 0;
    for (int k = 0; k < 400; ++k) {
      const Vec3 q = centre + dice.direction() * radius;
      const MapPoint<float> p = project_paraboloid(q);
      farthest = std::max(farthest, std::hypot(p.u - print.u, p.v - print.v) / print.radius);
    }
    EXPECT_LE(farthest, 1.001f);
    EXPECT_GE(farthest, 0.9f);
  }
  EXPECT_GE(paraboloid_footprint(Vec3{0, 0, 0.1f}, 0.4f).radius, 2) << "within the sphere: everywhere";
}

TEST(ShadowMapFormulas, CodesKeepDepthsToHalfAStep) {
  const float far = 17.5f;
  for (const float depth : {0.0f, 0.001f, 1.0f, 9.99f, 17.5f}) {
    const float code16 = encode_depth<std::uint16_t>(depth, kDepthSteps<std::uint16_t> / far);
    const float code32 = static_cast<float>(encode_depth<std::uint32_t>(depth, kDepthSteps<std::uint32_t> / far));
    EXPECT_NEAR(code16 * far / kDepthSteps<std::uint16_t>, depth, far / 65534 * 0.51f);
    EXPECT_NEAR(code32 * far / kDepthSteps<std::uint32_t>, depth, 3e-6f);
  }
  EXPECT_NE(encode_depth<std::uint16_t>(1e9f, 1), kNoDepth<std::uint16_t>) << "far away is not nothing";
}

TEST(ShadowMapFormulas, DistancesToABoxesFarthestCorner) {
  const Box box{{0, 0, 0}, {1, 2, 2}};
  EXPECT_FLOAT_EQ(farthest_distance(box, {0, 0, 0}), 3);
  EXPECT_FLOAT_EQ(farthest_distance(box, {1, 0, 4}), std::sqrt(1 + 4 + 16.0f));
}

class IsmKernelsTest : public testing::TestWithParam<Isa> {
 protected:
  const IsmKernels& kernels = ism_kernels(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Isa, IsmKernelsTest, testing::ValuesIn(available_isas()),
                         [](const testing::TestParamInfo<Isa>& parameter) {
                           std::string name(isa_name(parameter.param));
                           std::erase(name, '.');
                           return name;
                         });

constexpr float kInfinite = std::numeric_limits<float>::infinity();

/// Room to draw a map in.
struct Canvas {
  int size;
  std::unique_ptr<float[], void (*)(float*)> nearness;

  explicit Canvas(int s)
      : size(s), nearness(new (std::align_val_t{64}) float[floats()](), [](float* f) {
          ::operator delete[](f, std::align_val_t{64});
        }) {}
  [[nodiscard]] std::size_t floats() const { return nearness_floats(size); }
  /// Depth at a texel [m], infinite where nothing was drawn or beyond the rim.
  [[nodiscard]] float depth(const MapView& view, int x, int y) const {
    const float u = texel_centre(x, size), v = texel_centre(y, size), rho_sq = u * u + v * v;
    const float n = nearness[static_cast<std::size_t>(y) * nearness_stride(size) + static_cast<std::size_t>(x)];
    if (!(n > 0) || rho_sq >= view.rim_sq) return kInfinite;
    return view.half_width == 0 ? depth_of_nearness(n, 1 + rho_sq) : view.far - n;
  }
};

/// Points on some planes, with room behind them.
struct TestPoints {
  std::vector<float> values[8];
  std::vector<std::uint32_t> shape;
  std::vector<DiscShape> shapes;
  std::size_t count = 0;

  explicit TestPoints(float radius) : shapes(2) { shapes[0].radius = shapes[1].radius = radius; }
  /// @param sink  away from the light, on either side [m]
  void add(Vec3 p, Vec3 n, std::uint32_t which = 0, float sink = 0) {
    const float row[8] = {p.x, p.y, p.z, n.x, n.y, n.z, -sink, sink};
    for (std::size_t c = 0; c < 8; ++c) values[c].push_back(row[c]);
    shape.push_back(which);
    ++count;
  }
  PointArrays arrays() {
    for (auto& v : values) v.resize(count + 16);
    shape.resize(count + 16);
    return {values[0].data(), values[1].data(), values[2].data(), values[3].data(), values[4].data(),
            values[5].data(), values[6].data(), values[7].data(), shape.data(),     shapes.data()};
  }
};

TEST_P(IsmKernelsTest, ADiscsTexelsHoldItsPlane) {
  const Box bounds{{-3, -3, -3}, {3, 3, 3}};
  const Vec3 normal = normalize(Vec3{0.3f, -0.5f, -0.9f}), at{0.4f, 0.7f, 1.6f};
  DiscShape half;
  half.radius = 0.8f;
  half.inward[1] = normalize(cross(normal, Vec3{1, 0, 0}));
  half.offset[1] = dot(half.inward[1], at);
  for (const bool paraboloid : {true, false}) {
    for (const bool cut : {false, true}) {
      for (const int size : {16, 33, 64}) {
        MapView view = paraboloid ? paraboloid_view({0.1f, 0, -0.2f}, normalize(Vec3{0.1f, 0.2f, 1}), bounds)
                                  : orthographic_view(normalize(Vec3{0.1f, 0.2f, 1}), bounds);
        TestPoints points(0.8f);
        points.shapes.push_back(half);
        // Lies deeper as seen from the light, whose side the normal points to.
        points.add(at + normal * 0.05f, normal, cut ? 2 : 0, 0.05f);
        const Canvas canvas(size);
        kernels.draw(points.arrays(), 0, 1, view, size, canvas.nearness.get());

        int drawn = 0;
        for (int y = 0; y < size; ++y) {
          for (int x = 0; x < size; ++x) {
            // The texel's ray in double precision, the disc by definition.
            const double u = (2.0 * x + 1) / size - 1, v = (2.0 * y + 1) / size - 1, r = u * u + v * v;
            const Vec3T<double> n{normal.x, normal.y, normal.z}, p{at.x, at.y, at.z};
            const auto wide = [](Vec3 a) { return Vec3T<double>{a.x, a.y, a.z}; };
            Vec3T<double> o = wide(view.origin), w{0, 0, 1};
            if (paraboloid) w = {2 * u / (1 + r), 2 * v / (1 + r), (1 - r) / (1 + r)};
            w = wide(view.frame.x) * w.x + wide(view.frame.y) * w.y + wide(view.frame.z) * w.z;
            if (!paraboloid) o = o + (wide(view.frame.x) * u + wide(view.frame.y) * v) * double{view.half_width};
            const double t = dot(p - o, n) / dot(w, n);
            const Vec3T<double> q = o + w * t - p;
            const double reach = length(q), side = dot(q, wide(half.inward[1]));
            const bool border = std::abs(reach - 0.8) < 1e-4 || (cut && std::abs(side) < 1e-4);
            if (border) continue;
            const bool inside = t > 0 && reach < 0.8 && (!paraboloid || r < 1) && (!cut || side > 0);
            const float stored = canvas.depth(view, x, y);
            if (inside) {
              ASSERT_NEAR(stored, t, 1e-4) << x << ", " << y;
              ++drawn;
            } else {
              ASSERT_EQ(stored, kInfinite) << x << ", " << y;
            }
          }
        }
        EXPECT_GE(drawn, size / 8);
      }
    }
  }
}

TEST(ShadowMapFormulas, TheBoxHoldsTheDiscHoweverItIsTurned) {
  Dice dice(8);
  int checked = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vec3 centre = dice.direction() * dice.between(0.5f, 3), normal = dice.direction();
    const float radius = dice.between(0.01f, kSmallDisc) * length(centre);
    if (centre.z <= 0) continue;
    const MapBox<float> box = paraboloid_box(centre, normal, length(centre), radius);
    const Frame frame = make_frame(normal);
    for (int k = 0; k < 64; ++k) {
      const float angle = static_cast<float>(k) * kPi / 32;
      const MapPoint<float> p =
          project_paraboloid(centre + (frame.x * std::cos(angle) + frame.y * std::sin(angle)) * radius);
      ASSERT_LE(std::abs(p.u - box.u), box.half_u + 1e-5f);
      ASSERT_LE(std::abs(p.v - box.v), box.half_v + 1e-5f);
      ++checked;
    }
  }
  EXPECT_GT(checked, 50'000);
}

TEST_P(IsmKernelsTest, EverySplatIsDrawnWhateverItsPlaceInTheArrays) {
  Dice dice(3);
  const Box bounds{{-3, -3, -3}, {3, 3, 3}};
  const MapView view = paraboloid_view({0, 0, 0}, {0, 0, 1}, bounds);
  TestPoints points(0.1f);
  for (int i = 0; i < 61; ++i) points.add(dice.in_box(2), dice.direction());
  const PointArrays arrays = points.arrays();
  for (const std::size_t first : {0u, 5u, 16u}) {
    const Canvas together(32), single(32);
    kernels.draw(arrays, first, 43, view, 32, together.nearness.get());
    for (std::size_t i = first; i < first + 43; ++i) kernels.draw(arrays, i, 1, view, 32, single.nearness.get());
    for (std::size_t i = 0; i < 32 * nearness_stride(32); ++i) ASSERT_EQ(together.nearness[i], single.nearness[i]) << i;
  }
}

TEST_P(IsmKernelsTest, LookupsAreThoseOfThePlainFormula) {
  Dice dice(4);
  const Box bounds{{-2, -2, -2}, {2, 2, 2}};
  int differ = 0, all = 0;
  for (int round = 0; round < 60; ++round) {
    MapView view = round % 3 == 0 ? orthographic_view(dice.direction(), bounds)
                                  : paraboloid_view(dice.in_box(1), dice.direction(), bounds);
    const int size = round % 2 == 0 ? 32 : 64;
    const auto texels = static_cast<std::size_t>(size * size);
    constexpr std::size_t before = 16;  // lookups read a little around the codes
    std::vector<std::uint16_t> codes16(texels + 2 * before);
    std::vector<std::uint32_t> codes32(texels + 2 * before);
    for (std::size_t i = before; i < texels + before; ++i) {
      const float depth = dice.between(0, 1);
      codes16[i] = depth > 0.8f ? kNoDepth<std::uint16_t> : static_cast<std::uint16_t>(depth * 65534);
      codes32[i] = depth > 0.8f ? kNoDepth<std::uint32_t> : static_cast<std::uint32_t>(depth * 16777214);
    }
    const ReceiverPacket receivers = random_receivers(dice, false, 2);
    alignas(64) float share16[kPacketSize], share32[kPacketSize];
    const std::uint32_t candidates = static_cast<std::uint32_t>(dice.between(0, 1) * 65536) | 1u;
    kernels.look_up(receivers, candidates, make_map_record<std::uint16_t>(view, size), {&codes16[before], size, 16},
                    share16);
    kernels.look_up(receivers, candidates, make_map_record<std::uint32_t>(view, size), {&codes32[before], size, 32},
                    share32);
    for (int lane = 0; lane < kPacketSize; ++lane) {
      if ((candidates >> lane & 1u) == 0) {
        ASSERT_EQ(share16[lane], 0);
        ASSERT_EQ(share32[lane], 0);
        continue;
      }
      const Vec3 local = to_local_point(view, get_lane(receivers.position, lane));
      const Vec3 normal = to_local_vector(view.frame, get_lane(receivers.ng, lane));
      const auto at = [size](int x, int y) { return before + static_cast<std::size_t>(y * size + x); };
      const float plain16 =
          lookup_visibility<std::uint16_t>(view, local, normal, size, [&](int x, int y) { return codes16[at(x, y)]; });
      const float plain32 =
          lookup_visibility<std::uint32_t>(view, local, normal, size, [&](int x, int y) { return codes32[at(x, y)]; });
      all += 2;
      // Rounding may put a receiver on the other side of a texel's border.
      differ += (std::abs(plain16 - share16[lane]) > 1e-5f) + (std::abs(plain32 - share32[lane]) > 1e-5f);
    }
  }
  EXPECT_LE(differ, all / 500);
}

TEST_P(IsmKernelsTest, ALitPlaneAgreesWithItselfAtAnySlope) {
  // A map of one large plane, looked up at places of that plane: never dark, down to grazing light.
  const Box bounds{{-20, -20, -20}, {20, 20, 20}};
  for (const int size : {16, 32, 64, 128}) {
    for (const float tilt : {0.0f, 0.7f, 1.2f, 1.5f}) {
      const Vec3 normal{std::sin(tilt), 0, -std::cos(tilt)}, along{std::cos(tilt), 0, std::sin(tilt)};
      const MapView view = paraboloid_view({0, 0, 0}, {0, 0, 1}, bounds);
      TestPoints points(30);
      points.add(normal * -2.0f, normal);
      const Canvas canvas(size);
      kernels.draw(points.arrays(), 0, 1, view, size, canvas.nearness.get());
      std::vector<std::uint16_t> codes(static_cast<std::size_t>(size * size) + 32);
      kernels.encode16(canvas.nearness.get(), view, size, &codes[16]);
      Dice dice(5);
      for (int i = 0; i < 50; ++i) {
        ReceiverPacket receivers{};
        for (int lane = 0; lane < kPacketSize; ++lane) {
          const Vec3 at = normal * -2.0f + along * dice.between(-8, 8) + Vec3{0, 1, 0} * dice.between(-8, 8);
          set_lane(receivers.position, lane, at.z > 0.01f ? at : normal * -2.0f);
          set_lane(receivers.ng, lane, normal);
        }
        alignas(64) float share[kPacketSize];
        kernels.look_up(receivers, 0xffff, make_map_record<std::uint16_t>(view, size), {&codes[16], size, 16}, share);
        for (const float s : share) ASSERT_FLOAT_EQ(s, 1) << "size " << size << ", tilt " << tilt;
      }
    }
  }
}

}  // namespace
}  // namespace lightcuts
