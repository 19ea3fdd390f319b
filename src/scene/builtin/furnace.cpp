#include "scene/builtin/builtin.h"
#include "scene/builtin/shapes.h"

namespace lightcuts {

Scene make_furnace(const BuiltinOptions& options) {
  const float albedo = options.number("albedo", 0, 0.999f);
  const float emission = options.number("emission", 0, 1e6f);
  const float half = options.number("size", 1e-3f, 1e6f) / 2;

  Scene scene;
  const auto wall = add_material(scene, "wall", {albedo, albedo, albedo}, {emission, emission, emission});
  Mesh mesh;
  add_room(mesh, {{-half, -half, -half}, {half, half, half}});
  add_mesh(scene, std::move(mesh), "furnace", wall);

  // Off the centre, so that no symmetry hides an error.
  Camera camera = look_at(Vec3{0.3f, 0.2f, 0.4f} * half, Vec3{-0.5f, -0.4f, -1} * half, 1.2f);
  camera.name = "inside";
  camera.aspect = 1;
  scene.cameras.push_back(camera);
  scene.width = scene.height = 256;
  return scene;
}

}  // namespace lightcuts
