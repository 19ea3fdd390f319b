#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "cpu_shade/lit_backend.h"
#include "cpu_shade/rooms.h"
#include "cut/cut_scene.h"
#include "lightcuts/compare.h"

namespace lightcuts::test {
namespace {

struct Stage : LitBackend {
  Camera camera;

  Stage(Scene s, const Camera& c, std::uint64_t vpls, int threads = 2)
      : LitBackend(std::move(s), vpls, threads), camera(c) {}
  Image shade(const ShadeOptions& options, int width, int height) {
    return LitBackend::shade(camera, width, height, options);
  }
};

Stage builtin_stage(const std::string& name, std::uint64_t vpls) {
  Scene scene = make_builtin_scene(name);
  const Camera camera = select_camera(scene, "");
  return {std::move(scene), camera, vpls};
}

ShadeOptions cuts(CutWalk walk, Visibility visibility = Visibility::none) {
  ShadeOptions options;
  options.method = Method::lightcuts;
  options.cut = walk;
  options.visibility = visibility;
  return options;
}

ShadeOptions all_lights(Visibility visibility) {
  ShadeOptions options;
  options.visibility = visibility;
  return options;
}

void expect_same(const Image& a, const Image& b) {
  ASSERT_EQ(a.channels.size(), b.channels.size());
  for (std::size_t c = 0; c < a.channels.size(); ++c) EXPECT_EQ(a.channels[c].values, b.channels[c].values);
}

TEST(CutPicture, ThreadsDoNotChangeIt) {
  for (const CutWalk walk : {CutWalk::heap, CutWalk::packet}) {
    for (const Visibility visibility : {Visibility::rays, Visibility::none}) {
      Stage one(lit_room(), room_camera(), 400, 1), two(lit_room(), room_camera(), 400, 2);
      ShadeOptions options = cuts(walk, visibility);
      options.samples = 2;
      expect_same(one.shade(options, 37, 21), two.shade(options, 37, 21));
    }
  }
}

TEST(CutPicture, HasThePlanesOfTheCut) {
  Stage stage(lit_room(), room_camera(), 600);
  for (const CutWalk walk : {CutWalk::heap, CutWalk::packet}) {
    const Image image = stage.shade(cuts(walk, Visibility::rays), 24, 16);
    const std::vector<float>& size = find_channel(image, "cut.size")->values;
    const std::vector<float>& bound = find_channel(image, "cut.bound")->values;
    double sum = 0;
    for (std::size_t i = 0; i < size.size(); ++i) {
      sum += size[i];
      EXPECT_GE(size[i], 1);
      EXPECT_GE(bound[i], 0);
      EXPECT_LE(bound[i], 0.02f);
    }
    EXPECT_NEAR(stage.statistics.cut.mean, sum / static_cast<double>(size.size()), 1e-6);
    EXPECT_EQ(stage.statistics.cut.max, *std::max_element(size.begin(), size.end()));
    EXPECT_EQ(stage.statistics.cut.at_limit, 0);
    EXPECT_GT(stage.statistics.cut.lights_used, 100u);
    EXPECT_LE(stage.statistics.cut.lights_used, stage.backend.lights().count());
    EXPECT_GT(stage.statistics.rays, 24u * 16);
  }
}

TEST(CutPicture, SaysHowManyPixelsCameToTheLimit) {
  Stage stage(lit_room(), room_camera(), 600);
  for (const CutWalk walk : {CutWalk::heap, CutWalk::packet}) {
    ShadeOptions options = cuts(walk, Visibility::rays);
    options.max_cut = 40;
    stage.shade(options, 24, 16);
    EXPECT_EQ(stage.statistics.cut.max, walk == CutWalk::heap ? 40u : stage.statistics.cut.max);
    EXPECT_LE(stage.statistics.cut.max, 40u);
    EXPECT_GT(stage.statistics.cut.at_limit, 0.5);
  }
}

TEST(CutPicture, NothingLitIsBlackAndEnds) {
  Scene scene = lit_room();
  Stage stage(scene, look_at({5, 5, 5}, {9, 9, 9}, 1), 300);  // looks away from outside
  for (const CutWalk walk : {CutWalk::heap, CutWalk::packet}) {
    const Image image = stage.shade(cuts(walk, Visibility::rays), 16, 16);
    for (const float v : find_channel(image, "R")->values) EXPECT_EQ(v, 0);
    for (const float v : find_channel(image, "cut.size")->values) EXPECT_EQ(v, 0);
    EXPECT_EQ(stage.statistics.cut.mean, 0);
  }
}

TEST(CutPicture, HostileLightsLeaveNoNaN) {
  Stage stage(lit_room(), room_camera(), 100);
  Dice dice(1);
  Lights lights;
  const float huge = std::numeric_limits<float>::max();
  for (const float intensity : {0.0f, 1e-45f, 1e-30f, 1.0f, 1e15f, huge}) {
    for (int i = 0; i < 20; ++i) {
      lights.vpls.push_back({dice.in_box(1), dice.direction(), {intensity, intensity, intensity}});
      lights.points.push_back({dice.in_box(1), {intensity, 0, intensity}, dice.direction(), 0.3f, 0.2f});
      lights.directionals.push_back({dice.direction(), {0, intensity, 0}});
    }
  }
  stage.backend.set_lights(lights);
  stage.backend.build_light_tree({}, {});
  for (const CutWalk walk : {CutWalk::heap, CutWalk::packet}) {
    for (const std::uint32_t max_cut : {0u, 30u}) {
      for (const float min_distance : {0.0f, 0.01f}) {
        ShadeOptions options = cuts(walk, Visibility::rays);
        options.max_cut = max_cut;
        options.min_distance = min_distance;
        for (const Channel& channel : stage.shade(options, 16, 12).channels) {
          for (const float v : channel.values) {
            ASSERT_TRUE(std::isfinite(v) || channel.name == "depth.Z") << channel.name;
          }
        }
        EXPECT_FALSE(std::isnan(stage.statistics.clamped));
      }
    }
  }
}

TEST(CutPicture, InterruptedItKeepsWhatIsDone) {
  Stage stage(lit_room(), room_camera(), 2000);
  ShadeOptions options = cuts(CutWalk::packet, Visibility::rays);
  options.samples = 1000;
  int calls = 0;
  const ShadeResult result = stage.backend.shade(stage.camera, 64, 64, options, 0, stage.statistics,
                                                 [&](const char*, double) { return ++calls < 4; });
  EXPECT_FALSE(result.complete);
  ASSERT_NE(find_channel(result.image, "weight"), nullptr);
  for (const float v : find_channel(result.image, "weight")->values) EXPECT_LT(v, 1);
  ASSERT_NE(find_channel(result.image, "cut.size"), nullptr);
}

/// Against Instant Radiosity over the same lights.
void expect_near_all_lights(Stage& stage, int side, const std::string& name) {
  for (const Visibility visibility : {Visibility::none, Visibility::rays}) {
    const Image reference = stage.shade(all_lights(visibility), side, side);
    const Image image = stage.shade(cuts(CutWalk::packet, visibility), side, side);
    const Comparison c = compare(image, reference);
    const std::string what = name + (visibility == Visibility::none ? " none" : " rays");
    std::printf("%s: mean %.4f p99 %.4f signed %.5f, cut %.0f\n", what.c_str(), c.mean_relative_error,
                c.p99_relative_error, c.signed_relative_error, stage.statistics.cut.mean);
    EXPECT_LE(c.mean_relative_error, 0.015) << what;
    EXPECT_LE(c.p99_relative_error, 0.05) << what;
    EXPECT_LE(std::abs(c.signed_relative_error), 0.002) << what;
  }
}

TEST(CutPicture, IsNearInstantRadiosity) {
  for (const char* name : {"study", "cornell", "interior"}) {
    Stage stage = builtin_stage(name, 3000);
    expect_near_all_lights(stage, 48, name);
  }
}

TEST(CutPicture, SignedErrorsCancelOutOverSeedsOfTheTree) {
  for (const char* name : {"study", "interior"}) {
    Stage stage = builtin_stage(name, 1000);
    const Image reference = stage.shade(all_lights(Visibility::none), 16, 16);
    constexpr int seeds = 100;
    double sum = 0, squares = 0;
    for (int seed = 1; seed <= seeds; ++seed) {
      TreeOptions tree;
      tree.seed = static_cast<std::uint64_t>(seed);
      stage.backend.build_light_tree(tree, {});
      const Image image = stage.shade(cuts(CutWalk::packet), 16, 16);
      const double error = compare(image, reference).signed_relative_error;
      sum += error;
      squares += error * error;
    }
    const double mean = sum / seeds, deviation = std::sqrt(squares / seeds - mean * mean);
    std::printf("%s: signed error %.5f, of one seed +-%.5f\n", name, mean, deviation);
    EXPECT_LE(std::abs(mean), 3 * deviation / std::sqrt(seeds)) << name;
    EXPECT_LE(std::abs(mean), 0.002) << name;
  }
}

// Every sample has other representatives, so what they are off by averages out; afterwards the trees are as they were.
TEST(CutPicture, MoreSamplesBringItNearerToInstantRadiosity) {
  Stage stage = builtin_stage("study", 2000);
  for (const CutWalk walk : {CutWalk::packet, CutWalk::heap}) {
    const auto pictures = [&](int samples) {
      ShadeOptions exact = all_lights(Visibility::rays), options = cuts(walk, Visibility::rays);
      exact.samples = options.samples = samples;
      return std::pair(stage.shade(options, 24, 24), stage.shade(exact, 24, 24));
    };
    const auto [once, exact_once] = pictures(1);
    const auto [often, exact_often] = pictures(9);
    EXPECT_LT(compare(often, exact_often).mean_relative_error, 0.5 * compare(once, exact_once).mean_relative_error);
    EXPECT_EQ(find_channel(pictures(1).first, "G")->values, find_channel(once, "G")->values);
  }
}

double mean_error(Stage& stage, const ShadeOptions& options, const Image& reference) {
  return compare(stage.shade(options, 32, 32), reference).mean_relative_error;
}

TEST(CutPicture, WithALargestCutItIsHardlyFurtherOffThanTheHeaps) {
  Stage stage = builtin_stage("study", 2000);
  for (const Visibility visibility : {Visibility::none, Visibility::rays}) {
    const Image reference = stage.shade(all_lights(visibility), 32, 32);
    for (const std::uint32_t most : {30u, 100u}) {
      ShadeOptions heap = cuts(CutWalk::heap, visibility), packet = cuts(CutWalk::packet, visibility);
      heap.max_cut = packet.max_cut = most;
      const double ours = mean_error(stage, packet, reference), gold = mean_error(stage, heap, reference);
      EXPECT_LE(ours, 1.2 * gold) << most;
    }
  }
}

/// The lit room seen through a screen of holes, half of it cut out by an alpha mask.
Scene masked_room() {
  Scene scene = lit_room();
  TextureImage holes;
  holes.width = holes.height = 2;
  holes.channels = 4;
  holes.texels = {255, 255, 255, 255, 255, 255, 255, 0, 255, 255, 255, 0, 255, 255, 255, 255};
  scene.images.push_back(holes);
  Material screen;
  screen.base_color = {0.6f, 0.6f, 0.2f};
  screen.base_color_texture.image = 0;
  screen.base_color_texture.nearest = true;
  screen.alpha_mode = AlphaMode::mask;
  screen.double_sided = true;
  scene.materials.push_back(screen);
  add_rectangle(scene, {-0.7f, -0.5f, 0.2f}, {1.4f, 0, 0}, {0, 1.2f, 0.1f}, 2);
  scene.meshes.back().texcoords[0] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  return scene;
}

TEST(CutPicture, SamplesAndAlphaMasksAreThoseOfInstantRadiosity) {
  Stage stage(masked_room(), room_camera(), 400);
  for (const CutWalk walk : {CutWalk::heap, CutWalk::packet}) {
    for (const Visibility visibility : {Visibility::none, Visibility::rays}) {
      ShadeOptions exact = cuts(walk, visibility), reference = all_lights(visibility);
      exact.error = 0;
      exact.samples = reference.samples = 3;
      const Image image = stage.shade(exact, 32, 24), expected = stage.shade(reference, 32, 24);
      EXPECT_LE(compare(image, expected).p99_relative_error, 1e-5);
      for (const char* plane : {"albedo.R", "normal.X", "depth.Z"}) {
        EXPECT_EQ(find_channel(image, plane)->values, find_channel(expected, plane)->values) << plane;
      }
    }
  }
}

// Tiles, and the packets within, must not show in the size of cuts.
TEST(CutPicture, SizesShowNoPatternOfTiles) {
  Stage stage = builtin_stage("study", 2000);
  for (const Visibility visibility : {Visibility::none, Visibility::rays}) {
    const int side = visibility == Visibility::none ? 160 : 96;
    const double share = 1.0 / (side * side);
    const Image image = stage.shade(cuts(CutWalk::packet, visibility), side, side);
    const std::vector<float>& size = find_channel(image, "cut.size")->values;
    double packets[4] = {}, mean = 0;
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const float s = size[static_cast<std::size_t>(y * side + x)];
        packets[y % 8 / 4 * 2 + x % 8 / 4] += 4 * share * s;
        mean += share * s;
      }
    }
    for (const double packet : packets) EXPECT_NEAR(packet, mean, 0.03 * mean);
  }
}

TEST(CutPicture, WithoutErrorItIsInstantRadiosity) {
  Stage stage = builtin_stage("cornell", 300);
  for (const CutWalk walk : {CutWalk::heap, CutWalk::packet}) {
    for (const Visibility visibility : {Visibility::none, Visibility::rays}) {
      ShadeOptions options = cuts(walk, visibility);
      options.error = 0;
      const Comparison c = compare(stage.shade(options, 32, 32), stage.shade(all_lights(visibility), 32, 32));
      EXPECT_LE(c.p99_relative_error, 1e-5);
    }
  }
}

TEST(CutPicture, LampsAlone) {
  Stage stage = builtin_stage("lamps?count=500", 500);
  expect_near_all_lights(stage, 64, "lamps");
}

}  // namespace
}  // namespace lightcuts::test
