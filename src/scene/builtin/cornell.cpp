#include <cmath>

#include "scene/builtin/builtin.h"
#include "scene/builtin/shapes.h"

// The Cornell box as Cornell University's Program of Computer Graphics measured it (published 1998): geometry in
// millimetres, reflectances every 4 nm, the lamp every 100 nm. The colours are those spectra under the lamp's own light in
// linear Rec. 709, computed by tools/cornell_rgb.py.

namespace lightcuts {
namespace {

constexpr Vec3 kWhite{0.7386f, 0.7354f, 0.7506f};
constexpr Vec3 kRed{0.4489f, 0.0390f, 0.0102f};
constexpr Vec3 kGreen{0.1188f, 0.3818f, 0.0241f};
constexpr Vec3 kLamp{0.78f, 0.78f, 0.78f};
constexpr Vec3 kLampEmission{20.6549f, 10.9001f, 2.7664f};

Vec3 mm(float x, float y, float z) { return {x / 1000, y / 1000, z / 1000}; }

/// A block from the corners of its top, counter-clockwise from above; it stands on the floor and has no underside.
Mesh block(const std::array<Vec3, 4>& top) {
  Mesh mesh;
  add_quad(mesh, top[0], top[1], top[2], top[3]);
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 a = top[i], b = top[(i + 1) % 4];
    add_quad(mesh, a, {a.x, 0, a.z}, {b.x, 0, b.z}, b);
  }
  return mesh;
}

Mesh quad(Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
  Mesh mesh;
  add_quad(mesh, a, b, c, d);
  return mesh;
}

/// The published data lay the lamp over the whole ceiling; here the ceiling has an opening that the lamp fills.
Mesh ceiling(const std::array<Vec3, 4>& lamp) {
  Mesh mesh;
  add_ring(mesh, {mm(556, 548.8f, 0), mm(556, 548.8f, 559.2f), mm(0, 548.8f, 559.2f), mm(0, 548.8f, 0)}, lamp);
  return mesh;
}

}  // namespace

Scene make_cornell(const BuiltinOptions&) {
  Scene scene;
  const auto white = add_material(scene, "white", kWhite);
  const auto red = add_material(scene, "red", kRed);
  const auto green = add_material(scene, "green", kGreen);
  const auto lamp_material = add_material(scene, "lamp", kLamp, kLampEmission);

  const std::array<Vec3, 4> lamp = {mm(343, 548.8f, 227), mm(343, 548.8f, 332), mm(213, 548.8f, 332),
                                    mm(213, 548.8f, 227)};
  add_mesh(scene, quad(lamp[0], lamp[1], lamp[2], lamp[3]), "lamp", lamp_material);
  add_mesh(scene, ceiling(lamp), "ceiling", white);
  add_mesh(scene, quad(mm(552.8f, 0, 0), mm(0, 0, 0), mm(0, 0, 559.2f), mm(549.6f, 0, 559.2f)), "floor", white);
  add_mesh(scene, quad(mm(549.6f, 0, 559.2f), mm(0, 0, 559.2f), mm(0, 548.8f, 559.2f), mm(556, 548.8f, 559.2f)),
           "back wall", white);
  add_mesh(scene, quad(mm(0, 0, 559.2f), mm(0, 0, 0), mm(0, 548.8f, 0), mm(0, 548.8f, 559.2f)), "right wall", green);
  add_mesh(scene, quad(mm(552.8f, 0, 0), mm(549.6f, 0, 559.2f), mm(556, 548.8f, 559.2f), mm(556, 548.8f, 0)),
           "left wall", red);
  add_mesh(scene, block({mm(130, 165, 65), mm(82, 165, 225), mm(240, 165, 272), mm(290, 165, 114)}), "short block",
           white);
  add_mesh(scene, block({mm(423, 330, 247), mm(265, 330, 296), mm(314, 330, 456), mm(472, 330, 406)}), "tall block",
           white);

  // The published camera: focal length 35 mm behind a film of 25 x 25 mm.
  Camera camera = look_at(mm(278, 273, -800), mm(278, 273, -799), 2 * std::atan(0.0125f / 0.035f));
  camera.name = "camera";
  camera.aspect = 1;
  scene.cameras.push_back(camera);
  scene.width = scene.height = 1000;
  return scene;
}

}  // namespace lightcuts
