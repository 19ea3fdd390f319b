#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>

#include "backend/emitter_table.h"
#include "cpu_core/scene_parts.h"
#include "math/chi_square.h"

namespace lightcuts {
namespace {

constexpr std::uint32_t kSamples = 100000;
constexpr double kPiD = 3.14159265358979323846;

SampleStream random_stream(std::uint32_t index) { return {21, index, false}; }

TEST(Emitters, AreChosenByPower) {
  Scene scene;
  test::add_material(scene, {0, 0, 0}, {1, 1, 1});
  test::add_material(scene, {0, 0, 0}, {3, 3, 3}, true);
  test::add_material(scene, {0.5f, 0.5f, 0.5f});
  test::place(scene, test::quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0));
  test::place(scene, test::quad({0, 0, 1}, {1, 0, 0}, {0, 1, 0}, 2));  // does not emit
  test::place(scene, test::quad({0, 0, 2}, {1, 0, 0}, {0, 1, 0}, 1));
  scene.point_lights.push_back({{0, 0, 3}, {0.5f, 0.5f, 0.5f}});
  scene.point_lights.push_back({{0, 0, 3}, {2, 2, 2}, {0, 0, -1}, 0.9f, 0.6f});
  scene.directional_lights.push_back({{0, 0, -1}, {0.2f, 0.2f, 0.2f}});
  scene.environment = Environment{{0.1f, 0.1f, 0.1f}, nullptr};
  const SceneArrays cpu(scene);
  const EmitterTable table(cpu);
  const EmitterView& e = table.view();
  ASSERT_EQ(e.entry_count(), 8u);
  const double disc = kPiD * e.radius * e.radius;
  std::vector<double> power{kPiD * 0.5, kPiD * 0.5,           kPiD * 3,
                            kPiD * 3,   4 * kPiD * 0.5,       2 * kPiD * 2 * (0.1 + 0.3 / 3),
                            0.2 * disc, 4 * kPiD * 0.1 * disc};
  double total = 0;
  for (const double p : power) total += p;
  EXPECT_NEAR(table.total_power(), total, 1e-4 * total);
  for (double& p : power) p /= total;
  std::vector<std::uint64_t> counts(8);
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const Choice c = sample_emitter(e, 0, 8, random_stream(i).draw(0).unit_double(0));
    EXPECT_NEAR(c.probability, power[c.index], 1e-5);
    EXPECT_NEAR(c.probability, pdf_emitter(e, c.index), 1e-12);
    ++counts[c.index];
  }
  test::expect_distribution(counts, power);
  EXPECT_EQ(emissive_triangle(e, 3).instance, 2u);
  EXPECT_EQ(emissive_triangle(e, 3).triangle, 1u);
}

TEST(Emitters, NoEntryWithoutWeightIsChosen) {
  const double prefix[] = {0, 0, 1, 1, 3, 3};
  for (const double u : {0.0, 0.3333, 0.3334, 0.5, 0.999999, 1 - 0x1p-32, 1.0}) {
    const Choice c = sample_prefix(prefix, 0, 5, u);
    EXPECT_TRUE(c.index == 1 || c.index == 3) << u;
    EXPECT_GT(c.probability, 0);
  }
}

TEST(PointLights, SpotsSendPhotonsByTheirIntensity) {
  const PointLight spot{{0, 0, 0}, {2, 2, 2}, normalize(Vec3{1, 2, -3}), 0.8f, 0.3f};
  std::vector<std::uint64_t> counts(40);
  std::vector<double> expected(40, 0);
  for (int i = 0; i < 40; ++i) {  // cells of equal cosine from 0.3 to 1; the shape integrated by many points
    for (int k = 0; k < 100; ++k) {
      const double cosine = 0.3 + 0.7 * (i + (k + 0.5) / 100) / 40;
      const double s = std::min(1.0, (cosine - 0.3) / 0.5);
      expected[i] += s * s * 0.7 / 4000;
    }
  }
  double total = 0;
  for (const double x : expected) total += x;
  EXPECT_NEAR(point_light_solid_angle(spot), 2 * kPiD * total, 1e-3);
  for (double& x : expected) x /= total;
  // The dimmest cells hold too little for the test: pool them.
  while (expected[0] * kSamples < 5) expected[1] += expected[0], expected.erase(expected.begin());
  const std::size_t pooled = 40 - expected.size();
  counts.resize(expected.size());
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const Vec3 d = sample_point_light(spot, random_stream(i).draw(0).unit2(0));
    const double cosine = dot(d, spot.axis);
    ASSERT_GE(cosine, 0.3 - 1e-5);
    const int cell = std::clamp(static_cast<int>((cosine - 0.3) / 0.7 * 40), 0, 39);
    ++counts[static_cast<std::size_t>(cell) < pooled ? 0 : static_cast<std::size_t>(cell) - pooled];
    const float intensity = eval_point_light(spot, d).x;
    EXPECT_NEAR(pdf_point_light(spot, d), intensity / (2 * point_light_solid_angle(spot)), 1e-5);
  }
  test::expect_distribution(counts, expected);
}

/// 16 x 8 texels of random brightness, some black.
Scene scene_under_picture() {
  Scene scene;
  auto image = std::make_shared<Image>(make_rgb_image(16, 8));
  std::mt19937 random(3);
  for (Channel& c : image->channels) {
    for (float& v : c.values) v = random() % 4 == 0 ? 0.0f : static_cast<float>(random() % 100) / 50;
  }
  scene.environment = Environment{{1, 2, 0.5f}, image};
  return scene;
}

TEST(Environment, IsSampledByWhatIsInterpolatedInItsTexels) {
  const Scene scene = scene_under_picture();
  const SceneArrays cpu(scene);
  const EmitterTable table(cpu);
  const EnvironmentView& e = table.view().environment;
  // A texel gets three quarters of its own share each way and an eighth of both neighbours': what a tent leaves there.
  std::vector<double> expected;
  double sphere = 0, total = 0;
  for (int y = 0; y < 8; ++y) {
    sphere += 16 * environment_solid_angle(e, y);
    for (int x = 0; x < 16; ++x) {
      double sum = 0;
      for (int k = 0; k < 9; ++k) {
        const int dx = k % 3 - 1, dy = k / 3 - 1;
        sum += (dx == 0 ? 0.75 : 0.125) * (dy == 0 ? 0.75 : 0.125) * environment_share(e, x + dx, y + dy);
      }
      expected.push_back(sum);
      total += sum;
    }
  }
  EXPECT_NEAR(sphere, 4 * kPiD, 1e-9);
  EXPECT_NEAR(total, 1, 1e-6);

  // What the sky brings in all, by a fine grid; every place that shines can be drawn.
  double integral = 0, chance = 0;
  constexpr int kFine = 16;
  for (int y = 0; y < 8 * kFine; ++y) {
    for (int x = 0; x < 16 * kFine; ++x) {
      const double theta = kPiD * (y + 0.5) / (8 * kFine);
      const float u = (static_cast<float>(x) + 0.5f) / (16 * kFine), v = (static_cast<float>(y) + 0.5f) / (8 * kFine);
      const double shine = luminance(interpolate_environment(e, {u, v}));
      const double solid_angle = std::sin(theta) * (kPiD / (8 * kFine)) * (2 * kPiD / (16 * kFine));
      integral += shine * solid_angle;
      chance += pdf_environment_at(e, {u, v}) * solid_angle;
      if (shine > 0) {
        ASSERT_GT(expected[static_cast<std::size_t>(16 * (y / kFine) + x / kFine)], 0);
      }
    }
  }
  EXPECT_NEAR(chance, 1, 1e-3);
  std::vector<std::uint64_t> counts(128);
  double mean_luminance = 0, mean_square = 0;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const Sample4 u = random_stream(i).draw(0);
    const EnvironmentSample s = sample_environment(e, u.unit_double(0), u.unit_double(1));
    EXPECT_NEAR(length(s.direction), 1, 1e-5);
    std::int32_t x = 0, y = 0;
    find_environment_texel(e, s.direction, &x, &y);
    ++counts[16 * y + x];
    const double estimate = luminance(s.radiance) / s.pdf;
    mean_luminance += estimate / kSamples;
    mean_square += estimate * estimate / kSamples;
    EXPECT_NEAR(luminance(eval_environment(e, s.direction)), luminance(s.radiance), 1e-3);
    EXPECT_NEAR(pdf_environment(e, s.direction), s.pdf, 1e-4 + 1e-3 * s.pdf);
  }
  test::expect_distribution(counts, expected);
  const double error = std::sqrt((mean_square - mean_luminance * mean_luminance) / kSamples);
  EXPECT_NEAR(mean_luminance, integral, 3 * error + 1e-4 * integral);
  EXPECT_LT(error, 2e-3 * integral);
}

TEST(Environment, CentreIsSeenAlongMinusZAndURunsRight) {
  Scene scene;
  auto image = std::make_shared<Image>(make_rgb_image(4, 2));
  for (Channel& c : image->channels) {
    for (std::size_t i = 0; i < 8; ++i) c.values[i] = static_cast<float>(i + 1);
  }
  scene.environment = Environment{{1, 1, 1}, image};
  const SceneArrays cpu(scene);
  const EmitterTable table(cpu);
  const EnvironmentView& e = table.view().environment;
  const float up = std::sqrt(0.5f), far = 0.5f;
  EXPECT_NEAR(eval_environment(e, {far, up, -far}).x, 3, 1e-4);   // right of the centre, above: a texel's centre
  EXPECT_NEAR(eval_environment(e, {-far, up, -far}).x, 2, 1e-4);  // left of it
  EXPECT_NEAR(eval_environment(e, {far, -up, far}).x, 8, 1e-4);   // right, turned to the back, below
  EXPECT_NEAR(eval_environment(e, {-far, -up, far}).x, 5, 1e-4);
  EXPECT_NEAR(eval_environment(e, {0, up, -up}).x, 2.5, 1e-4);  // between two centres
  EXPECT_NEAR(eval_environment(e, {0, up, up}).x, 2.5, 1e-4);   // across the seam: between 4 and 1
  EXPECT_NEAR(eval_environment(e, {up, 0, -up}).x, 5, 1e-4);    // between the rows
  EXPECT_NEAR(eval_environment(e, {0, 1, 0}).x, 2.5, 1e-3);     // the pole is no centre: at u = 1/2
}

TEST(Emitters, DirectSamplesIntegrateToTheIrradiance) {
  // A tilted triangle over a point: the mean of the samples is a double-precision sum over its area.
  Scene scene;
  test::add_material(scene, {0, 0, 0}, {2, 2, 2}, true);
  Mesh mesh;
  mesh.positions = {{-1, 2, 0}, {1, 2.5f, 0.5f}, {0, 1.5f, 1}};
  mesh.triangles = {{0, 1, 2}};
  test::place(scene, mesh);
  const SceneArrays cpu(scene);
  const EmitterTable table(cpu);
  const TriangleGeometry g = triangle_geometry(cpu.view(), 0, 0);
  double expected = 0, mean = 0, mean_pdf_inverse = 0;
  constexpr int n = 400;
  for (int a = 0; a < n; ++a) {
    for (int b = 0; b + a < n; ++b) {
      for (const double shift : {1 / 3.0, 2 / 3.0}) {
        if (shift > 0.5 && a + b + 1 >= n) continue;
        const auto u = static_cast<float>((a + shift) / n), v = static_cast<float>((b + shift) / n);
        const Vec3 p = g.p0 + g.e1 * u + g.e2 * v;
        const double d = length(p), cosine = std::fabs(dot(g.front, p)) / d;
        expected += 2 * (p.y / d) * cosine / (d * d) * g.area / (double(n) * n);
      }
    }
  }
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const DirectSample s = sample_direct(cpu.view(), table.view(), {0, 0, 0}, SampleStream{1, i, true}.draw(0));
    mean += s.irradiance.x * s.direction.y / kSamples;
    mean_pdf_inverse += 1 / s.pdf / kSamples;
  }
  EXPECT_NEAR(mean, expected, 1e-3 * expected);
  EXPECT_GT(mean_pdf_inverse, 0);
}

// ---- Textures

struct Texture {
  Scene scene;
  Texture(int width, int height, int channels, std::vector<std::uint8_t> texels) {
    scene.images.push_back({"t", width, height, channels, std::move(texels)});
    scene.materials.emplace_back();
    scene.materials[0].base_color_texture.image = 0;
  }
  [[nodiscard]] Rgba at(float u, float v) const {
    const SceneArrays cpu(scene);
    return sample_texture(cpu.view(), cpu.view().materials[0].base_color_texture, {u, v});
  }
  TextureRef& ref() { return scene.materials[0].base_color_texture; }
};

TEST(Textures, FilterLinearColourBetweenTexelCentres) {
  Texture t(2, 1, 1, {0, 255});
  EXPECT_NEAR(t.at(0.25f, 0.5f).rgb.x, 0, 1e-6);
  EXPECT_NEAR(t.at(0.75f, 0.5f).rgb.x, 1, 1e-6);
  EXPECT_NEAR(t.at(0.5f, 0.5f).rgb.x, 0.5, 1e-6);  // of light, not of bytes
  EXPECT_NEAR(t.at(1, 0.5f).rgb.x, 0.5, 1e-6);     // repeats
  t.ref().wrap_u = Wrap::clamp_to_edge;
  EXPECT_NEAR(t.at(1, 0.5f).rgb.x, 1, 1e-6);
  EXPECT_NEAR(t.at(-7, 0.5f).rgb.x, 0, 1e-6);
  t.ref().wrap_u = Wrap::mirrored_repeat;
  EXPECT_NEAR(t.at(1.25f, 0.5f).rgb.x, 1, 1e-6);
  EXPECT_NEAR(t.at(1.75f, 0.5f).rgb.x, 0, 1e-6);
  EXPECT_NEAR(t.at(-0.25f, 0.5f).rgb.x, 0, 1e-6);
}

TEST(Textures, DecodeSrgbAndKeepAlphaLinear) {
  Texture t(1, 1, 4, {188, 0, 255, 51});
  const Rgba c = t.at(0.3f, 0.3f);
  EXPECT_NEAR(c.rgb.x, 0.50289, 1e-4);
  EXPECT_EQ(c.rgb.y, 0);
  EXPECT_NEAR(c.rgb.z, 1, 1e-6);
  EXPECT_NEAR(c.alpha, 0.2, 1e-6);
}

TEST(Textures, TransformAndStrangeCoordinatesStayInside) {
  Texture t(2, 2, 3, {10, 0, 0, 20, 0, 0, 30, 0, 0, 255, 0, 0});
  t.ref().nearest = true;
  t.ref().uv_transform = {0, 1, 0.5f, 1, 0, 0};
  EXPECT_NEAR(t.at(0.75f, 0.25f).rgb.x, 1, 1e-6);  // u' = v + 0.5, v' = u
  for (const Wrap wrap : {Wrap::repeat, Wrap::mirrored_repeat, Wrap::clamp_to_edge}) {
    t.ref().wrap_u = t.ref().wrap_v = wrap;
    for (const bool nearest : {true, false}) {
      t.ref().nearest = nearest;
      for (const float u : {1e30f, -1e30f, kInfinity, -kInfinity, std::nanf(""), 123456.7f, -1e-30f, 1e8f}) {
        EXPECT_TRUE(is_finite(t.at(u, -u).rgb)) << u;
      }
    }
  }
}

}  // namespace
}  // namespace lightcuts
