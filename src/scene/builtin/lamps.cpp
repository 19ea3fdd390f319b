#include <cmath>

#include "scene/builtin/builtin.h"
#include "scene/builtin/shapes.h"
#include "scene/builtin/surface.h"

// A hall of 32 x 8 x 20 m under a cloth of lamps. All lamps together have the same power whatever their number, so that
// pictures of one lamp and of a million have one exposure.

namespace lightcuts {
namespace {

constexpr Box kHall{{-16, 0, -10}, {16, 8, 10}};
constexpr float kTotalFlux = 4000;  ///< of all lamps together [W]

/// The i-th point of Roberts' R2 sequence in the unit square: evenly spread for any count. The first is the middle.
Vec2 spread(std::uint64_t i) {
  const double x = 0.5 + 0.7548776662466927 * static_cast<double>(i);
  const double y = 0.5 + 0.5698402909980532 * static_cast<double>(i);
  return {static_cast<float>(x - std::floor(x)), static_cast<float>(y - std::floor(y))};
}

/// Where lamp i hangs: a wavy cloth, half a metre inside the walls, above everything that stands.
Vec3 lamp_position(std::uint64_t i) {
  const Vec2 s = spread(i);
  const float x = (s.x - 0.5f) * 31, z = (s.y - 0.5f) * 19;
  return {x, 6.2f + 0.5f * std::sin(0.7f * x + 0.4f) * std::cos(0.55f * z), z};
}

/// Warm and cool regions that blend into each other, with luminance 1 everywhere.
Vec3 lamp_color(Vec3 p) {
  const float cool = 0.5f + 0.5f * std::sin(0.22f * p.x + 1.1f * std::sin(0.2f * p.z));
  const float rose = 0.5f + 0.5f * std::sin(0.3f * p.z - 0.15f * p.x);
  const Vec3 color = Vec3{1.0f, 0.5f, 0.15f} * (1 - cool) +
                     (Vec3{0.2f, 0.55f, 1.0f} * (1 - rose) + Vec3{1.0f, 0.2f, 0.45f} * rose) * cool;
  return color / luminance(color);
}

void add_point_lamps(Scene& scene, std::uint64_t count) {
  const float intensity = kTotalFlux / (4 * kPi * static_cast<float>(count));
  scene.point_lights.resize(count);
  for (std::uint64_t i = 0; i < count; ++i) {
    scene.point_lights[i].position = lamp_position(i);
    scene.point_lights[i].intensity = lamp_color(scene.point_lights[i].position) * intensity;
  }
}

/// One square, instanced: a quarter of the distance to its neighbours wide, at most 20 cm.
void add_quad_lamps(Scene& scene, std::uint64_t count) {
  const auto n = static_cast<float>(count);
  const float side = std::fmin(0.2f, 0.25f * std::sqrt(31 * 19 / n));
  const float radiance = kTotalFlux / (kPi * side * side * n);
  const Vec3 warm{1.0f, 0.8f, 0.55f};
  Mesh square;
  const float h = side / 2;
  add_quad(square, {-h, 0, -h}, {h, 0, -h}, {h, 0, h}, {-h, 0, h});
  square.name = "lamp";
  square.material = add_material(scene, "lamp", {0.5f, 0.5f, 0.5f}, warm * (radiance / luminance(warm)));
  const auto mesh = static_cast<std::uint32_t>(scene.meshes.size());
  scene.meshes.push_back(square);
  scene.instances.reserve(scene.instances.size() + count);
  for (std::uint64_t i = 0; i < count; ++i) {
    Instance lamp;
    lamp.mesh = mesh;
    lamp.world_from_object.origin = lamp_position(i);
    scene.instances.push_back(lamp);
  }
}

Mesh column() {
  Mesh mesh;
  const std::vector<Vec2> profile = {{0.62f, 0},     {0.62f, 0.18f}, {0.52f, 0.22f}, {0.54f, 0.32f},
                                     {0.44f, 0.42f}, {0.40f, 0.6f},  {0.39f, 1.6f},  {0.36f, 2.8f},
                                     {0.33f, 3.7f},  {0.38f, 3.78f}, {0.38f, 3.86f}, {0.34f, 3.9f},
                                     {0.42f, 4.05f}, {0.56f, 4.2f},  {0.56f, 4.34f}, {0, 4.34f}};
  add_lathe(mesh, profile, 40, {});
  return mesh;
}

Mesh ball(float radius) {
  Mesh mesh;
  add_ball(mesh, {0, radius, 0}, radius, 48);
  return mesh;
}

void place(Scene& scene, std::uint32_t mesh, Vec3 origin) {
  Instance instance;
  instance.mesh = mesh;
  instance.name = scene.meshes[mesh].name;
  instance.world_from_object.origin = origin;
  scene.instances.push_back(instance);
}

void add_hall(Scene& scene) {
  const auto wall = add_material(scene, "wall", {0.6f, 0.57f, 0.53f});
  const auto floor = add_material(scene, "floor", {0.3f, 0.28f, 0.27f});
  const auto dark = add_material(scene, "inlay", {0.6f, 0.56f, 0.5f});
  const auto stone = add_material(scene, "stone", {0.7f, 0.67f, 0.6f});
  const auto bronze = add_material(scene, "bronze", {0.5f, 0.33f, 0.2f});

  Mesh walls, ground, inlay, steps;
  add_room(walls, kHall, "-y");
  add_room(ground, kHall, "-x +x +y -z +z");
  for (int i = -5; i <= 5; ++i) {
    const float x = 2.6f * static_cast<float>(i);
    add_box(inlay, {{x - 0.6f, 0, -1.2f}, {x + 0.6f, 0.01f, 1.2f}});
  }
  for (int i = 0; i < 4; ++i) {
    const float y = 0.2f * static_cast<float>(i), d = 0.45f * static_cast<float>(i);
    add_box(steps, {{11 + d, y, -6 + d}, {15.9f, y + 0.2f, 6 - d}});
  }
  add_mesh(scene, walls, "walls", wall);
  add_mesh(scene, ground, "floor", floor);
  add_mesh(scene, inlay, "inlay", dark);
  add_mesh(scene, steps, "steps", stone);

  // Two rows of columns and bronze balls between them.
  add_mesh(scene, column(), "column", stone);
  const auto column_mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
  scene.instances.pop_back();
  add_mesh(scene, ball(0.7f), "ball", bronze);
  const auto ball_mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
  scene.instances.pop_back();
  for (int i = -3; i <= 2; ++i) {
    for (const float z : {-5.0f, 5.0f}) {
      const float x = 4 * static_cast<float>(i) + 1;
      place(scene, column_mesh, {x, 0, z});
      if (i % 2 == 0) place(scene, ball_mesh, {x + 2, 0, z});
    }
  }
  place(scene, ball_mesh, {13.2f, 0.8f, 0});
}

}  // namespace

Scene make_lamps(const BuiltinOptions& options) {
  const std::uint64_t count = options.integer("count", 1, 1'000'000);
  const std::string kind = options.choice("kind", {"point", "quad"});

  Scene scene;
  add_hall(scene);
  if (kind == "point") {
    add_point_lamps(scene, count);
  } else {
    add_quad_lamps(scene, count);
  }
  Camera camera = look_at({-14.2f, 2.4f, 2.6f}, {2, 2.6f, -0.6f}, 0.95f);
  camera.name = "hall";
  camera.aspect = 1.6f;
  scene.cameras.push_back(camera);
  scene.width = 1280;
  scene.height = 800;
  return scene;
}

}  // namespace lightcuts
