#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string_view>
#include <tuple>

#include "lightcuts/error.h"
#include "lightcuts/scene.h"

namespace lightcuts {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

std::string refusal(const std::string& spec) {
  try {
    make_builtin_scene(spec);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::invalid_argument);
    return error.what();
  }
  ADD_FAILURE() << spec << " was accepted";
  return {};
}

double area(const Mesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.positions[t[0]];
    sum += 0.5 * length(cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a));
  }
  return sum;
}

/// Positive where the triangles face outwards.
double signed_volume(const Mesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    sum += dot(mesh.positions[t[0]], cross(mesh.positions[t[1]], mesh.positions[t[2]])) / 6.0;
  }
  return sum;
}

/// Closed: every edge is used as often in one direction as in the other.
bool is_closed(const Mesh& mesh) {
  using Point = std::tuple<float, float, float>;
  const auto key = [&](std::uint32_t i) {
    return Point(mesh.positions[i].x, mesh.positions[i].y, mesh.positions[i].z);
  };
  std::map<std::pair<Point, Point>, int> balance;
  for (const auto& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Point a = key(t[i]), b = key(t[(i + 1) % 3]);
      a < b ? ++balance[{a, b}] : --balance[{b, a}];
    }
  }
  return std::all_of(balance.begin(), balance.end(), [](const auto& edge) { return edge.second == 0; });
}

const Mesh& mesh_named(const Scene& scene, std::string_view name) {
  return *std::find_if(scene.meshes.begin(), scene.meshes.end(), [&](const Mesh& mesh) { return mesh.name == name; });
}

TEST(Builtin, EveryOneIsValidShinesAndHasACamera) {
  EXPECT_GE(builtin_scenes().size(), 4u);
  for (const BuiltinInfo& info : builtin_scenes()) {
    SCOPED_TRACE(info.name);
    EXPECT_FALSE(info.summary.empty());
    Scene scene = make_builtin_scene(info.name);
    EXPECT_EQ(scene.name, info.name);
    EXPECT_THAT(validate(scene), IsEmpty());
    EXPECT_TRUE(emits_light(scene));
    ASSERT_FALSE(scene.cameras.empty());
    EXPECT_GT(scene.width, 0);
    EXPECT_GT(scene.height, 0);
    for (const BuiltinKey& key : info.keys) {
      EXPECT_NO_THROW(make_builtin_scene(info.name + "?" + key.name + "=" + key.default_value));
    }
  }
}

TEST(Builtin, RefusesWhatItDoesNotKnowAndSaysWhatThereIs) {
  EXPECT_THAT(refusal("nowhere"), AllOf(HasSubstr("nowhere"), HasSubstr("cornell"), HasSubstr("study")));
  EXPECT_THAT(refusal(""), HasSubstr("cornell"));
  EXPECT_THAT(refusal("cornell?size=3"), AllOf(HasSubstr("size"), HasSubstr("no keys")));
  EXPECT_THAT(refusal("furnace?albdo=0.5"), AllOf(HasSubstr("albdo"), HasSubstr("albedo, emission, size")));
  EXPECT_THAT(refusal("furnace?albedo=1"), AllOf(HasSubstr("0 to 0.999"), HasSubstr("\"1\"")));
  EXPECT_THAT(refusal("furnace?albedo"), HasSubstr("albedo=VALUE"));
  EXPECT_THAT(refusal("furnace?albedo="), HasSubstr("a number"));
  EXPECT_THAT(refusal("furnace?albedo=nan"), HasSubstr("a number"));
  EXPECT_THAT(refusal("furnace?albedo=0.5x"), HasSubstr("a number"));
  EXPECT_THAT(refusal("furnace?albedo=0.5&albedo=0.6"), HasSubstr("once"));
  EXPECT_THAT(refusal("furnace?size=0"), HasSubstr("size"));
  for (const char* count : {"0", "1000001", "-1", "1e3", "99999999999999999999"}) {
    EXPECT_THAT(refusal(std::string("lamps?count=") + count), HasSubstr("1 to 1000000"));
  }
  EXPECT_THAT(refusal("lamps?kind=neon"), HasSubstr("point or quad"));
}

TEST(Furnace, IsAClosedBoxThatFacesInwards) {
  const Scene scene = make_builtin_scene("furnace?albedo=0.25&emission=3&size=4");
  ASSERT_EQ(scene.meshes.size(), 1u);
  EXPECT_TRUE(is_closed(scene.meshes[0]));
  EXPECT_NEAR(signed_volume(scene.meshes[0]), -64, 1e-4);
  ASSERT_EQ(scene.materials.size(), 1u);
  EXPECT_EQ(scene.materials[0].base_color, (Vec3{0.25f, 0.25f, 0.25f}));
  EXPECT_EQ(scene.materials[0].emission, (Vec3{3, 3, 3}));
  const Vec3 eye = scene.cameras[0].world_from_camera.origin;
  EXPECT_LT(std::max({std::fabs(eye.x), std::fabs(eye.y), std::fabs(eye.z)}), 2);
}

TEST(Cornell, HasTheMeasuredSizes) {
  const Scene scene = make_builtin_scene("cornell");
  EXPECT_NEAR(area(mesh_named(scene, "lamp")), 0.130 * 0.105, 1e-6);
  EXPECT_NEAR(area(mesh_named(scene, "ceiling")), 0.556 * 0.5592 - 0.130 * 0.105, 1e-6);
  EXPECT_NEAR(length(scene_bounds(scene).hi - Vec3{0.556f, 0.5488f, 0.5592f}), 0, 1e-6);
  EXPECT_NEAR(scene.cameras[0].vertical_fov_rad * 180 / kPi, 39.3077, 1e-3);
}

TEST(Cornell, FacesTheRoom) {
  const Scene scene = make_builtin_scene("cornell");
  const Vec3 middle{0.278f, 0.274f, 0.28f};
  for (const Mesh& mesh : scene.meshes) {
    SCOPED_TRACE(mesh.name);
    const bool block = mesh.name.find("block") != std::string::npos;
    Vec3 inside = middle;
    if (block) inside = center(scene_bounds({"", {}, scene.materials, {mesh}, {{"", 0, {}}}, {}, {}, {}, {}, 0, 0}));
    for (const auto& t : mesh.triangles) {
      const Vec3 a = mesh.positions[t[0]];
      const float side = dot(cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a), inside - a);
      EXPECT_TRUE(block ? side < 0 : side > 0);
    }
  }
}

TEST(Lamps, KeepTheirPowerAndTheirPlace) {
  for (const char* count : {"1", "7", "1000", "1000000"}) {
    SCOPED_TRACE(count);
    const Scene scene = make_builtin_scene(std::string("lamps?count=") + count);
    EXPECT_EQ(scene.point_lights.size(), std::stoul(count));
    double power = 0;
    for (const PointLight& light : scene.point_lights) {
      power += 4 * kPi * luminance(light.intensity);
      ASSERT_GT(light.position.y, 5) << "lamps hang above everything that stands";
      ASSERT_LT(light.position.y, 7.5f);
      ASSERT_LT(std::fabs(light.position.x), 15.6f);
      ASSERT_LT(std::fabs(light.position.z), 9.6f);
    }
    EXPECT_NEAR(power, 4000, 4);
  }
}

TEST(Lamps, QuadsShineDownWithTheSamePower) {
  for (const char* count : {"1", "100000"}) {
    const Scene scene = make_builtin_scene(std::string("lamps?kind=quad&count=") + count);
    const Mesh& square = mesh_named(scene, "lamp");
    const auto mesh = static_cast<std::uint32_t>(&square - scene.meshes.data());
    const auto drawn = std::count_if(scene.instances.begin(), scene.instances.end(),
                                     [&](const Instance& instance) { return instance.mesh == mesh; });
    EXPECT_EQ(drawn, std::stol(count));
    const double flux = kPi * area(square) * luminance(scene.materials[square.material].emission);
    EXPECT_NEAR(flux * static_cast<double>(drawn), 4000, 4);
    const Vec3 a = square.positions[square.triangles[0][0]];
    EXPECT_LT(cross(square.positions[square.triangles[0][1]] - a, square.positions[square.triangles[0][2]] - a).y, 0);
  }
}

/// Mean of a picture's texels as they reflect, by the sRGB curve's usual approximation.
Vec3 mean_albedo(const TextureImage& image) {
  double sum[3] = {};
  for (std::size_t i = 0; i < image.texels.size(); ++i) sum[i % 3] += std::pow(image.texels[i] / 255.0, 2.2);
  const double pixels = static_cast<double>(image.width) * image.height;
  return {static_cast<float>(sum[0] / pixels), static_cast<float>(sum[1] / pixels),
          static_cast<float>(sum[2] / pixels)};
}

TEST(Interior, IsARealisticRoomInBothLights) {
  const Scene sun = make_builtin_scene("interior?light=sun"), lamp = make_builtin_scene("interior?light=lamp");
  EXPECT_EQ(sun.directional_lights.size(), 1u);
  EXPECT_TRUE(lamp.directional_lights.empty());
  EXPECT_GT(drawn_triangle_count(sun), 5000u);
  EXPECT_LT(drawn_triangle_count(sun), 100000u);
  const Box box = scene_bounds(sun);
  EXPECT_NEAR(length(box.lo - Vec3{-3.22f, 0, -3.5f}), 0, 1e-4) << "something stands outside the room";
  EXPECT_NEAR(length(box.hi - Vec3{3, 2.8f, 3.5f}), 0, 1e-4) << "something stands outside the room";
  std::vector<Vec3> pictures;
  for (const TextureImage& image : sun.images) pictures.push_back(mean_albedo(image));
  for (const Material& material : sun.materials) {
    SCOPED_TRACE(material.name);
    const auto& texture = material.base_color_texture;
    const Vec3 albedo = texture.present() ? material.base_color * pictures[texture.image] : material.base_color;
    EXPECT_GT(luminance(albedo), 0.05f);
    EXPECT_LT(std::max({albedo.x, albedo.y, albedo.z}), 0.86f);
  }
}

TEST(Interior, NormalsLieOnTheFrontOfTheirTriangles) {
  const Scene scene = make_builtin_scene("interior");
  for (const Mesh& mesh : scene.meshes) {
    if (mesh.normals.empty()) continue;
    std::size_t wrong = 0;
    for (const auto& t : mesh.triangles) {
      const Vec3 a = mesh.positions[t[0]];
      const Vec3 front = cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a);
      for (const std::uint32_t corner : t) wrong += dot(front, mesh.normals[corner]) < 0 ? 1 : 0;
    }
    // Where a leaf folds at its stalk, a corner may lean over.
    EXPECT_LE(wrong, mesh.triangles.size() / 50) << mesh.name << " with material " << mesh.material;
  }
}

}  // namespace
}  // namespace lightcuts
