#include "cpu/cpu_backend.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "cpu_shade/random_packet.h"
#include "cpu_shade/rooms.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

VplOptions few_vpls() {
  VplOptions options;
  options.count = 300;
  return options;
}

Image shade_with(int threads, const ShadeOptions& options) {
  Scene scene = lit_room();
  validate(scene);
  CpuBackend backend(threads);
  backend.set_scene(scene, {});
  backend.trace_vpls(few_vpls(), {});
  Statistics statistics;
  return backend.shade(room_camera(), 37, 21, options, 0, statistics, {}).image;
}

void expect_same(const Image& a, const Image& b) {
  ASSERT_EQ(a.channels.size(), b.channels.size());
  for (std::size_t c = 0; c < a.channels.size(); ++c) {
    EXPECT_EQ(a.channels[c].name, b.channels[c].name);
    EXPECT_EQ(a.channels[c].values, b.channels[c].values) << a.channels[c].name;
  }
}

TEST(CpuBackend, ThreadsDoNotChangeThePicture) {
  for (const Visibility visibility : {Visibility::rays, Visibility::none}) {
    ShadeOptions options;
    options.visibility = visibility;
    options.samples = 3;
    expect_same(shade_with(1, options), shade_with(2, options));
  }
  ShadeOptions path;
  path.method = Method::path;
  path.samples = 4;
  expect_same(shade_with(1, path), shade_with(4, path));
}

/// Backend with the lit room loaded, and room for what each test needs.
struct Loaded {
  Scene scene = lit_room();
  CpuBackend backend{2};
  Statistics statistics;

  Loaded() {
    validate(scene);
    backend.set_scene(scene, {});
  }
  Image shade(const Lights& lights, const ShadeOptions& options = {}) {
    backend.set_lights(lights);
    return backend.shade(room_camera(), 24, 16, options, 0, statistics, {}).image;
  }
};

TEST(CpuBackend, PlanesHoldWhatTheCameraSees) {
  Loaded room;
  const Image image = room.shade({});
  const auto at = [&](const char* name, int x, int y) { return find_channel(image, name)->values[24u * y + x]; };
  // The lamp is seen above: its own radiance, nothing else being lit.
  const std::vector<float>& red = find_channel(image, "R")->values;
  EXPECT_FLOAT_EQ(*std::max_element(red.begin(), red.end()), 5);
  // The far wall left of the screen: 1.95 m away along the view, facing the camera, of the walls' colour.
  EXPECT_FLOAT_EQ(at("albedo.R", 2, 5), 0.7f);
  EXPECT_NEAR(at("normal.X", 2, 5), 1, 1e-6);
  EXPECT_NEAR(at("normal.Z", 12, 5), 1, 1e-6);
  EXPECT_NEAR(at("depth.Z", 12, 5), 1.95f, 0.2f);
  EXPECT_FLOAT_EQ(at("R", 12, 5), 0);
  EXPECT_EQ(find_channel(image, "weight"), nullptr);
}

TEST(CpuBackend, MissesShowTheEnvironmentAtInfiniteDepth) {
  Scene scene;
  scene.materials.emplace_back();
  add_rectangle(scene, {-1, -1, -5}, {1, 0, 0}, {0, 2, 0}, 0);
  scene.environment = Environment{{0.5f, 1, 2}, nullptr};
  validate(scene);
  CpuBackend backend(1);
  backend.set_scene(scene, {});
  Statistics statistics;
  const Image image = backend.shade(look_at({0, 0, 0}, {0, 0, -1}, 0.2f), 8, 8, {}, 0, statistics, {}).image;
  const std::vector<float>& blue = find_channel(image, "B")->values;
  const std::vector<float>& depth = find_channel(image, "depth.Z")->values;
  EXPECT_EQ(blue[0], 0);
  EXPECT_NEAR(depth[0], 5, 1e-5);
  EXPECT_EQ(blue[7], 2);
  EXPECT_TRUE(std::isinf(depth[7]));
}

TEST(CpuBackend, HostileLightsLeaveNoNaN) {
  Loaded room;
  Dice dice(1);
  Lights lights;
  const float huge = std::numeric_limits<float>::max();
  for (const float intensity : {0.0f, 1e-45f, 1e-30f, 1.0f, 1e15f, huge}) {
    for (int i = 0; i < 20; ++i) {
      lights.vpls.push_back({dice.in_box(1), dice.direction(), {intensity, intensity, intensity}});
      lights.points.push_back({dice.in_box(1), {intensity, 0, intensity}, dice.direction(), 0.3f, 0.3f});
      lights.directionals.push_back({dice.direction(), {0, intensity, 0}});
    }
  }
  lights.vpls.push_back({{0, 0, 0}, {0, 0, 0}, {1, 1, 1}});            // no axis
  lights.vpls.push_back({{0, 0, 0}, {0, 1e30f, 0}, {1, 1, 1}});        // an absurd one
  lights.vpls.push_back({{9e8f, -9e8f, 9e8f}, {0, 1, 0}, {1, 1, 1}});  // far away
  for (const Visibility visibility : {Visibility::rays, Visibility::none}) {
    for (const float min_distance : {0.0f, 0.01f}) {
      ShadeOptions options;
      options.visibility = visibility;
      options.min_distance = min_distance;
      for (const Channel& channel : room.shade(lights, options).channels) {
        for (const float v : channel.values) {
          ASSERT_FALSE(std::isnan(v)) << channel.name;
          ASSERT_TRUE(std::isfinite(v) || channel.name == "depth.Z") << channel.name;
        }
      }
      EXPECT_FALSE(std::isnan(room.statistics.clamped));
    }
  }
}

TEST(CpuBackend, StoppingKeepsWholeSamplesAndSaysHowMany) {
  Loaded room;
  Dice dice(2);
  Lights lights;
  for (int i = 0; i < 2000; ++i) lights.vpls.push_back({dice.in_box(1), dice.direction(), {1, 1, 1}});
  room.backend.set_lights(lights);
  ShadeOptions options;
  options.samples = 1000;
  int calls = 0;
  const ProgressFn stop_soon = [&](const char* stage, double done) {
    EXPECT_STREQ(stage, "shade");
    EXPECT_GE(done, 0);
    EXPECT_LE(done, 1);
    return ++calls < 4;
  };
  const ShadeResult result = room.backend.shade(room_camera(), 64, 64, options, 0, room.statistics, stop_soon);
  EXPECT_FALSE(result.complete);
  EXPECT_EQ(result.image.attributes.at("complete"), "false");
  const Channel* weight = find_channel(result.image, "weight");
  ASSERT_NE(weight, nullptr);
  float most = 0;
  for (std::size_t i = 0; i < weight->values.size(); ++i) {
    most = std::max(most, weight->values[i]);
    EXPECT_LT(weight->values[i], 1);
    // A pixel with any sample shows its surface undimmed, one without is empty.
    const float albedo = find_channel(result.image, "albedo.R")->values[i];
    if (weight->values[i] == 0) {
      EXPECT_EQ(albedo, 0);
    } else {
      EXPECT_GT(albedo, 0.29f);
    }
  }
  EXPECT_GT(most, 0);
}

TEST(CpuBackend, RefusesWhatItDoesNotHave) {
  Loaded room;
  const auto code_of = [&](const ShadeOptions& options, std::uint64_t memory) {
    try {
      room.backend.shade(room_camera(), 64, 64, options, memory, room.statistics, {});
    } catch (const Error& error) {
      return error.code();
    }
    return Code::no_device;  // not thrown here
  };
  room.backend.set_lights({{{{0, 0.5f, 0}, {0, -1, 0}, {1, 1, 1}}}, {}, {}});
  ShadeOptions cuts;
  cuts.method = Method::lightcuts;
  EXPECT_EQ(code_of(cuts, 0), Code::invalid_argument);  // no tree over its lights
  EXPECT_EQ(code_of({}, 1000), Code::out_of_memory);
  CpuBackend empty(1);
  EXPECT_THROW(empty.trace_vpls({}, {}), Error);
}

TEST(CpuBackend, CountsRaysAndPairs) {
  Loaded room;
  Lights lights;
  lights.vpls.push_back({{0, 0.5f, 0}, {0, -1, 0}, {1, 1, 1}});
  room.shade(lights);
  EXPECT_EQ(room.statistics.pairs, 24u * 16);
  EXPECT_GT(room.statistics.rays, 50u);
  EXPECT_LT(room.statistics.rays, 24u * 16);
}

}  // namespace
}  // namespace lightcuts
