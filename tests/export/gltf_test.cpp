#include <gmock/gmock.h>

#include <cmath>

#include "export_scenes.h"
#include "lightcuts/error.h"
#include "lightcuts/export.h"
#include "lightcuts/io.h"

namespace lightcuts::test {
namespace {

void expect_near(Vec3 a, Vec3 b, float tolerance, const std::string& what) {
  EXPECT_NEAR(a.x, b.x, tolerance * std::max(1.0f, std::abs(b.x))) << what;
  EXPECT_NEAR(a.y, b.y, tolerance * std::max(1.0f, std::abs(b.y))) << what;
  EXPECT_NEAR(a.z, b.z, tolerance * std::max(1.0f, std::abs(b.z))) << what;
}

void expect_near(const Affine& a, const Affine& b, float tolerance, const std::string& what) {
  expect_near(a.x, b.x, tolerance, what);
  expect_near(a.y, b.y, tolerance, what);
  expect_near(a.z, b.z, tolerance, what);
  expect_near(a.origin, b.origin, tolerance, what);
}

void expect_same_texture(const TextureRef& a, const Scene& in_a, const TextureRef& b, const Scene& in_b,
                         const Mesh& mesh) {
  ASSERT_EQ(a.present(), b.present());
  if (!a.present()) return;
  EXPECT_FALSE(mesh.texcoords[a.texcoord].empty());
  EXPECT_EQ(a.texcoord, b.texcoord);
  EXPECT_EQ(a.wrap_u, b.wrap_u);
  EXPECT_EQ(a.wrap_v, b.wrap_v);
  EXPECT_EQ(a.nearest, b.nearest);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(a.uv_transform[i], b.uv_transform[i], 1e-5f) << i;
  const TextureImage &pa = in_a.images[a.image], &pb = in_b.images[b.image];
  EXPECT_EQ(pa.width, pb.width);
  EXPECT_EQ(pa.height, pb.height);
  EXPECT_EQ(pa.channels, pb.channels);
  EXPECT_EQ(pa.texels, pb.texels);
}

void expect_same_material(const Material& a, const Scene& in_a, const Material& b, const Scene& in_b,
                          const Mesh& mesh) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.base_color, b.base_color);
  EXPECT_EQ(a.alpha, b.alpha);
  EXPECT_EQ(a.emission, b.emission);
  EXPECT_EQ(a.alpha_mode, b.alpha_mode);
  if (a.alpha_mode == AlphaMode::mask) {
    EXPECT_EQ(a.alpha_cutoff, b.alpha_cutoff);
  }
  EXPECT_EQ(a.double_sided, b.double_sided);
  expect_same_texture(a.base_color_texture, in_a, b.base_color_texture, in_b, mesh);
  if (max_component(a.emission) > 0) expect_same_texture(a.emission_texture, in_a, b.emission_texture, in_b, mesh);
}

/// Corner by corner, for vertices that no triangle uses are not read; nor are texture coordinates that no texture asks for.
void expect_same_mesh(const Mesh& a, const Mesh& b) {
  ASSERT_EQ(a.triangles.size(), b.triangles.size());
  ASSERT_EQ(a.normals.empty(), b.normals.empty());
  ASSERT_EQ(a.colors.empty(), b.colors.empty());
  for (std::size_t t = 0; t < a.triangles.size(); ++t) {
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t i = a.triangles[t][c], k = b.triangles[t][c];
      bool same = a.positions[i] == b.positions[k];
      same = same && (a.normals.empty() || a.normals[i] == b.normals[k]);
      same = same && (a.colors.empty() || a.colors[i] == b.colors[k]);
      for (std::size_t set = 0; set < 2; ++set) {
        if (a.texcoords[set].empty()) continue;
        same = same && a.texcoords[set][i].x == b.texcoords[set][k].x && a.texcoords[set][i].y == b.texcoords[set][k].y;
      }
      ASSERT_TRUE(same) << "corner " << c << " of triangle " << t;
    }
  }
}

void expect_same_lights(const Scene& a, const Scene& b) {
  ASSERT_EQ(a.point_lights.size(), b.point_lights.size());
  for (std::size_t i = 0; i < a.point_lights.size(); ++i) {
    const PointLight &p = a.point_lights[i], &q = b.point_lights[i];
    expect_near(p.position, q.position, 0, "light");
    expect_near(p.intensity, q.intensity, 1e-6f, "intensity");
    if (q.cos_outer < -1) continue;
    expect_near(p.axis, q.axis, 1e-6f, "spot's axis");
    EXPECT_NEAR(p.cos_inner, q.cos_inner, 1e-6f);
    EXPECT_NEAR(p.cos_outer, q.cos_outer, 1e-6f);
  }
  ASSERT_EQ(a.directional_lights.size(), b.directional_lights.size());
  for (std::size_t i = 0; i < a.directional_lights.size(); ++i) {
    expect_near(a.directional_lights[i].direction, b.directional_lights[i].direction, 1e-6f, "direction");
    expect_near(a.directional_lights[i].irradiance, b.directional_lights[i].irradiance, 1e-6f, "irradiance");
  }
}

void expect_same_cameras(const Scene& a, const Scene& b) {
  ASSERT_EQ(a.cameras.size(), b.cameras.size());
  for (std::size_t i = 0; i < a.cameras.size(); ++i) {
    const Camera &c = a.cameras[i], &d = b.cameras[i];
    EXPECT_EQ(c.name, d.name);
    expect_near(c.world_from_camera, d.world_from_camera, 1e-6f, "camera");
    EXPECT_EQ(c.orthographic_height, d.orthographic_height);
    if (c.orthographic_height == 0) {
      EXPECT_EQ(c.vertical_fov_rad, d.vertical_fov_rad);
    }
    EXPECT_NEAR(c.aspect, d.aspect, 1e-6f);
  }
}

/// Numbers of materials and meshes may change on the way, instances may not.
void expect_same(const Scene& a, const Scene& b) {
  ASSERT_EQ(a.instances.size(), b.instances.size());
  for (std::size_t i = 0; i < a.instances.size(); ++i) {
    SCOPED_TRACE("instance " + std::to_string(i) + " " + b.instances[i].name);
    const Mesh &m = a.meshes[a.instances[i].mesh], &n = b.meshes[b.instances[i].mesh];
    expect_near(a.instances[i].world_from_object, b.instances[i].world_from_object, 1e-6f, "instance");
    expect_same_mesh(m, n);
    expect_same_material(a.materials[m.material], a, b.materials[n.material], b, m);
    if (testing::Test::HasFailure()) return;
  }
  expect_same_lights(a, b);
  expect_same_cameras(a, b);
}

void expect_round_trip(const Scene& scene) {
  const ExportFolder folder;
  for (const char* name : {"a b%.gltf", "c.glb"}) {
    SCOPED_TRACE(name);
    EXPECT_EQ(export_scene(folder.file(name), scene).size(), scene.environment ? 1u : 0u);
    expect_same(load_scene(folder.file(name)).scene, scene);
  }
}

TEST(ExportGltf, EverythingComesBack) { expect_round_trip(scene_of_everything()); }

class BuiltinScenes : public testing::TestWithParam<const char*> {};
TEST_P(BuiltinScenes, ComeBackFromGltf) { expect_round_trip(builtin(GetParam())); }
INSTANTIATE_TEST_SUITE_P(ExportGltf, BuiltinScenes,
                         testing::Values("cornell", "study", "furnace", "interior", "lamps?count=20"));

class Rooms : public testing::TestWithParam<const char*> {};
TEST_P(Rooms, ComeBackFromGltf) {
  const std::filesystem::path file = std::filesystem::path(LC_SHARED_SCENES) / "rooms" / GetParam() / "scene.gltf";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "the shared scenes are not beside this checkout";
  expect_round_trip(load_scene(file).scene);
}
INSTANTIATE_TEST_SUITE_P(ExportGltf, Rooms, testing::Values("cornell-box", "veach-bidir", "modern-hall"));

TEST(ExportGltf, WhatItCannotSayIsSaid) {
  const ExportFolder folder;
  Scene scene = builtin("cornell");
  scene.environment = Environment{};
  const std::vector<std::string> warnings = export_scene(folder.file("x.glb"), scene);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], testing::HasSubstr("--environment"));
}

TEST(ExportGltf, OtherEndingsAreRefused) {
  try {
    export_scene("x.fbx", builtin("cornell"));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::invalid_argument);
    EXPECT_THAT(error.what(), testing::HasSubstr(".glb"));
  }
}

}  // namespace
}  // namespace lightcuts::test
