#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "lightcuts/scene.h"

namespace lightcuts::test {

/// A folder of this test, emptied at its start and removed at its end.
class ExportFolder {
 public:
  ExportFolder() {
    std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
    std::replace(name.begin(), name.end(), '/', '-');
    path_ = std::filesystem::temp_directory_path() / ("lightcuts-export-" + std::to_string(getpid()) + "-" + name);
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~ExportFolder() { std::filesystem::remove_all(path_); }
  ExportFolder(const ExportFolder&) = delete;
  ExportFolder& operator=(const ExportFolder&) = delete;
  [[nodiscard]] std::filesystem::path file(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

inline Scene builtin(const std::string& spec) {
  Scene scene = make_builtin_scene(spec);
  validate(scene);
  return scene;
}

/// One of everything that a scene can hold.
inline Scene scene_of_everything() {
  Scene scene;
  TextureImage picture{"checker", 2, 2, 4, {255, 0, 0, 255, 0, 255, 0, 10, 0, 0, 255, 200, 9, 8, 7, 0}};
  scene.images.push_back(picture);
  Material painted;
  painted.name = "painted";
  painted.base_color = {0.5f, 0.25f, 0.125f};
  painted.alpha = 0.75f;
  painted.base_color_texture.image = 0;
  painted.base_color_texture.texcoord = 1;
  painted.base_color_texture.wrap_u = Wrap::mirrored_repeat;
  painted.base_color_texture.wrap_v = Wrap::clamp_to_edge;
  painted.base_color_texture.nearest = true;
  painted.base_color_texture.uv_transform = {2, 0, 0.25f, 0, 3, -0.5f};
  painted.alpha_mode = AlphaMode::mask;
  painted.alpha_cutoff = 0.3f;
  Material lamp;
  lamp.name = "lamp & shade";
  lamp.emission = {17.3f, 0.1f, 5};
  lamp.emission_texture.image = 0;
  lamp.double_sided = true;
  scene.materials = {painted, lamp};

  Mesh mesh;
  mesh.name = "quad";
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0.1f}};
  mesh.normals = {{0, 0, 1}, {0, 0, 1}, {0.6f, 0, 0.8f}, {0, 0, 1}};
  mesh.texcoords[0] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  mesh.texcoords[1] = {{0.1f, 0}, {1, 0.2f}, {1, 1}, {0, 1}};
  mesh.colors = {{255, 0, 3, 255}, {1, 2, 3, 255}, {9, 8, 7, 128}, {0, 0, 0, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.meshes.push_back(mesh);
  mesh.name = "flat";
  mesh.normals.clear();
  mesh.colors.clear();
  mesh.material = 1;
  scene.meshes.push_back(mesh);
  const Affine mirrored{{-2, 0, 0}, {0, 1, 0.5f}, {0, -0.5f, 1}, {1, 2, 3}};
  scene.instances = {{"one", 0, {}}, {"two", 1, mirrored}, {"three", 0, mirrored}};

  scene.point_lights.push_back({{1, 2, 3}, {100, 20.5f, 0.25f}, {0, 0, -1}});
  scene.point_lights.push_back({{0, 5, 0}, {3, 2, 1}, {0.6f, -0.8f, 0}, 0.9f, 0.5f});
  scene.directional_lights.push_back({{0.6f, 0, -0.8f}, {4, 5, 0.5f}});
  Camera camera = look_at({3, 2, 1}, {0, 1, 0}, 0.7f);
  camera.name = "eye";
  camera.aspect = 1.5f;
  scene.cameras.push_back(camera);
  camera.name = "plan";
  camera.orthographic_height = 4;
  scene.cameras.push_back(camera);
  validate(scene);
  return scene;
}

}  // namespace lightcuts::test
