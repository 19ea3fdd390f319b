#include "scene/builtin/builtin.h"
#include "scene/builtin/shapes.h"

// Stands for the unpublished room of the study: closed, 10 x 5 x 10 m, a lamp of 2 x 2 m in the ceiling, 40 boxes.
// Every coordinate is a whole number of millimetres, divided once: so the geometry has the same bits everywhere, and a
// test pins their hash.

namespace lightcuts {
namespace {

struct Block {
  int x, bottom, z;          ///< middle of the base [mm]
  int width, height, depth;  ///< [mm]
  int turn;                  ///< index into kTurns, negative for the other way round
  int color;                 ///< index into kColors
};

/// Rotations by Pythagorean triples: cosine = a / c, sine = b / c.
constexpr int kTurns[][3] = {{1, 0, 1},   {4, 3, 5}, {12, 5, 13},  {15, 8, 17},
                             {24, 7, 25}, {3, 4, 5}, {35, 12, 37}, {40, 9, 41}};

/// Albedos of the boxes, all channels between 0.2 and 0.7.
constexpr Vec3 kColors[] = {{0.70f, 0.55f, 0.30f}, {0.65f, 0.36f, 0.26f}, {0.25f, 0.50f, 0.52f}, {0.45f, 0.55f, 0.38f},
                            {0.70f, 0.66f, 0.56f}, {0.34f, 0.40f, 0.48f}, {0.50f, 0.30f, 0.42f}, {0.55f, 0.55f, 0.55f},
                            {0.68f, 0.60f, 0.45f}, {0.22f, 0.30f, 0.50f}};

// Scattered once at random with 15 cm between any two, the middle of the floor and the camera's view left open.
constexpr Block kBlocks[] = {
    {2950, 0, -2800, 750, 3000, 1100, 0, 0},    {-4100, 0, -3900, 900, 3350, 950, 3, 1},
    {800, 0, -2750, 800, 3300, 800, -5, 6},     {-1500, 0, -2850, 750, 3050, 800, 0, 7},
    {3850, 0, -4050, 900, 2350, 950, -4, 3},    {4050, 0, -2450, 700, 3100, 1100, 0, 2},
    {-600, 0, -3650, 550, 1150, 650, 0, 9},     {1700, 0, -1400, 1250, 1350, 850, -6, 5},
    {4100, 0, -250, 1200, 950, 950, 5, 8},      {3450, 0, 2150, 900, 1250, 650, -5, 4},
    {1550, 0, -3800, 500, 650, 650, -1, 5},     {-3650, 0, -1850, 800, 1000, 1250, 4, 8},
    {-3750, 0, -50, 500, 900, 1050, 4, 4},      {-2850, 0, -2000, 500, 600, 500, 4, 0},
    {-3550, 0, 1300, 800, 1350, 500, -5, 1},    {-3600, 0, 3400, 650, 450, 500, 2, 6},
    {-2650, 0, -3400, 350, 450, 400, 7, 7},     {-3450, 0, -3050, 350, 400, 500, 0, 3},
    {-2100, 0, -1600, 450, 350, 450, -6, 2},    {-2750, 0, 3250, 450, 600, 500, 6, 9},
    {-2350, 0, 1800, 350, 450, 350, 6, 3},      {-2700, 0, -650, 600, 450, 650, -2, 2},
    {3800, 0, -1450, 300, 250, 300, 2, 9},      {2350, 0, -100, 500, 300, 600, -6, 5},
    {-3750, 2450, -450, 1100, 200, 650, 1, 8},  {300, 2600, -600, 1050, 500, 550, 0, 4},
    {1600, 3100, -4200, 750, 700, 600, 2, 0},   {-2550, 3800, -900, 400, 600, 1200, 0, 1},
    {-300, 1800, -100, 300, 450, 550, 1, 6},    {-4100, 3700, 500, 1000, 350, 750, 6, 7},
    {3350, 2400, -850, 550, 800, 450, 6, 1},    {3850, 3550, -450, 600, 500, 800, -6, 6},
    {-700, 2000, 700, 700, 400, 500, 2, 7},     {1250, 3750, -100, 1150, 500, 650, -3, 3},
    {-350, 1650, -1150, 850, 750, 300, -5, 2},  {2200, 1550, 100, 1100, 500, 600, 4, 9},
    {-2800, 2450, -3900, 650, 600, 1200, 1, 5}, {-4300, 2200, 1450, 850, 600, 750, -6, 8},
    {-3300, 2100, 900, 550, 450, 450, 1, 4},    {2300, 4000, -4050, 350, 200, 1100, -1, 0},
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
  const auto grey = add_material(scene, "floor", {0.5f, 0.48f, 0.45f});
  const auto red = add_material(scene, "red wall", {0.7f, 0.2f, 0.2f});
  const auto green = add_material(scene, "green wall", {0.2f, 0.7f, 0.2f});
  const auto lamp = add_material(scene, "lamp", {0.5f, 0.5f, 0.5f}, {20, 20, 20});

  const Box room{{-5, 0, -5}, {5, 5, 5}};
  Mesh walls, floor, left, right, light;
  add_room(walls, room, "-x +x -y +y");
  add_room(floor, room, "-x +x +y -z +z");
  add_room(left, room, "+x -y +y -z +z");
  add_room(right, room, "-x -y +y -z +z");
  const std::array<Vec3, 4> rim = {Vec3{-5, 5, -5}, {5, 5, -5}, {5, 5, 5}, {-5, 5, 5}};
  const std::array<Vec3, 4> opening = {Vec3{-1, 5, -1}, {1, 5, -1}, {1, 5, 1}, {-1, 5, 1}};
  add_ring(walls, rim, opening);
  add_quad(light, opening[0], opening[1], opening[2], opening[3]);
  add_mesh(scene, walls, "walls", white);
  add_mesh(scene, floor, "floor", grey);
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

  Camera camera = look_at({0.3f, 2.3f, 4.8f}, {-0.1f, 2.0f, -1}, 1.25f);
  camera.name = "camera";
  camera.aspect = 1;
  scene.cameras.push_back(camera);
  scene.width = scene.height = 1000;
  return scene;
}

}  // namespace lightcuts
