#include "scene/builtin/builtin.h"
#include "scene/builtin/shapes.h"

// Stands for the unpublished room of the study: closed, 10 x 5 x 10 m, a lamp of 2 x 2 m in the ceiling, 40 boxes.
// Every coordinate is a whole number of millimetres, divided once: so the geometry has the same bits everywhere, and a
// test pins their hash.

namespace lightcuts {
namespace {

struct Block {
  int x, bottom, z;              ///< middle of the base [mm]
  int width, height, depth;      ///< [mm]
  int turn;                      ///< index into kTurns, negative for the other way round
  int color;                     ///< index into kColors
};

/// Rotations by Pythagorean triples: cosine = a / c, sine = b / c.
constexpr int kTurns[][3] = {{1, 0, 1}, {4, 3, 5}, {12, 5, 13}, {15, 8, 17}, {24, 7, 25}, {3, 4, 5}, {35, 12, 37}, {40, 9, 41}};

/// Albedos of the boxes, all channels between 0.2 and 0.7.
constexpr Vec3 kColors[] = {{0.70f, 0.55f, 0.30f}, {0.65f, 0.36f, 0.26f}, {0.25f, 0.50f, 0.52f}, {0.45f, 0.55f, 0.38f},
                            {0.70f, 0.66f, 0.56f}, {0.34f, 0.40f, 0.48f}, {0.50f, 0.30f, 0.42f}, {0.55f, 0.55f, 0.55f},
                            {0.68f, 0.60f, 0.45f}, {0.22f, 0.30f, 0.50f}};

// Scattered once at random with 15 cm between any two, the middle of the floor and the camera's view left open.
constexpr Block kBlocks[] = {
    {2950, 0, -2800, 750, 3000, 1100, 0, 6},
    {-4100, 0, -3900, 900, 3350, 950, 3, 4},
    {800, 0, -2750, 800, 3300, 800, -5, 6},
    {-1500, 0, -2850, 750, 3050, 800, 0, 7},
    {3850, 0, -4050, 900, 2350, 950, -4, 7},
    {4050, 0, -2450, 700, 3100, 1100, 0, 7},
    {-600, 0, -3650, 550, 1150, 650, 0, 4},
    {1700, 0, -1400, 1250, 1350, 850, -6, 7},
    {4100, 0, -250, 1200, 950, 950, 5, 5},
    {3450, 0, 2150, 900, 1250, 650, -5, 0},
    {1550, 0, -3800, 500, 650, 650, -1, 5},
    {-3650, 0, -1850, 800, 1000, 1250, 4, 8},
    {-2700, 0, 2200, 1100, 1400, 950, 6, 0},
    {-3750, 0, -50, 500, 900, 1050, 4, 2},
    {-2850, 0, -2000, 500, 600, 500, 4, 3},
    {-3850, 0, 3050, 450, 350, 400, -2, 1},
    {-1700, 0, -1500, 600, 350, 500, 4, 3},
    {-2650, 0, -3400, 350, 450, 400, 7, 5},
    {-4150, 0, 1000, 500, 350, 450, -4, 9},
    {-3150, 0, 1000, 650, 500, 450, 2, 3},
    {-3450, 0, -3050, 350, 400, 500, 0, 0},
    {-2050, 0, -2150, 450, 450, 300, 0, 3},
    {-2750, 0, 3250, 450, 600, 500, 6, 3},
    {-2700, 0, -650, 600, 450, 650, -2, 3},
    {-3950, 2600, -500, 400, 300, 650, 7, 6},
    {-3800, 3800, -2850, 1100, 600, 350, -2, 1},
    {3650, 3700, -2850, 400, 650, 1000, 6, 1},
    {-3000, 3300, -3200, 700, 300, 800, 1, 9},
    {-2300, 4200, 600, 900, 200, 650, 6, 1},
    {3700, 1200, -1000, 550, 200, 750, -5, 6},
    {50, 1800, -2000, 500, 450, 850, 4, 9},
    {1450, 2650, -150, 450, 400, 700, 0, 8},
    {-1450, 3100, -4300, 650, 200, 750, 5, 7},
    {-3200, 3050, -450, 950, 850, 950, 0, 0},
    {3150, 2550, -400, 550, 600, 300, 2, 7},
    {-1100, 2000, -4200, 600, 500, 1200, 5, 5},
    {-300, 2050, 100, 650, 850, 300, 4, 5},
    {4250, 2400, 1300, 750, 850, 950, 6, 9},
    {2600, 1500, -150, 450, 550, 950, -5, 1},
    {-2850, 1950, -2950, 650, 200, 600, -2, 9},
};

Mesh make_block(const Block& block) {
  const int* turn = kTurns[block.turn < 0 ? -block.turn : block.turn];
  const int cosine = turn[0], sine = block.turn < 0 ? -turn[1] : turn[1], scale = turn[2];
  std::array<Vec3, 8> corners;
  for (int i = 0; i < 8; ++i) {
    const int x = (i & 1) != 0 ? block.width / 2 : -block.width / 2;
    const int y = (i & 2) != 0 ? block.height : 0;
    const int z = (i & 4) != 0 ? block.depth / 2 : -block.depth / 2;
    const auto metres = [](int millimetres) { return static_cast<float>(millimetres) / 1000.0f; };
    corners[static_cast<std::size_t>(i)] = {metres(block.x + (cosine * x + sine * z) / scale), metres(block.bottom + y),
                                            metres(block.z + (cosine * z - sine * x) / scale)};
  }
  Mesh mesh;
  add_hexahedron(mesh, corners);
  return mesh;
}

void add_walls(Scene& scene) {
  const auto white = add_material(scene, "white wall", {0.7f, 0.7f, 0.7f});
  const auto red = add_material(scene, "red wall", {0.7f, 0.2f, 0.2f});
  const auto green = add_material(scene, "green wall", {0.2f, 0.7f, 0.2f});
  const auto lamp = add_material(scene, "lamp", {0.5f, 0.5f, 0.5f}, {20, 20, 20});

  const Box room{{-5, 0, -5}, {5, 5, 5}};
  Mesh walls, left, right, light;
  add_room(walls, room, "-x +x +y");
  add_room(left, room, "+x -y +y -z +z");
  add_room(right, room, "-x -y +y -z +z");
  const std::array<Vec3, 4> rim = {Vec3{-5, 5, -5}, {5, 5, -5}, {5, 5, 5}, {-5, 5, 5}};
  const std::array<Vec3, 4> opening = {Vec3{-1, 5, -1}, {1, 5, -1}, {1, 5, 1}, {-1, 5, 1}};
  add_ring(walls, rim, opening);
  add_quad(light, opening[0], opening[1], opening[2], opening[3]);
  add_mesh(scene, walls, "walls", white);
  add_mesh(scene, left, "left wall", red);
  add_mesh(scene, right, "right wall", green);
  add_mesh(scene, light, "lamp", lamp);
}

}  // namespace

Scene make_study(const BuiltinOptions&) {
  Scene scene;
  add_walls(scene);
  const auto first_color = static_cast<std::uint32_t>(scene.materials.size());
  for (const Vec3 color : kColors) add_material(scene, "box color", color);
  for (const Block& block : kBlocks) {
    add_mesh(scene, make_block(block), "box", first_color + static_cast<std::uint32_t>(block.color));
  }

  Camera camera = look_at({0.7f, 2.3f, 4.7f}, {-0.3f, 1.5f, -1}, 1.05f);
  camera.name = "camera";
  camera.aspect = 1;
  scene.cameras.push_back(camera);
  scene.width = scene.height = 1000;
  return scene;
}

}  // namespace lightcuts
