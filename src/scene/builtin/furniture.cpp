#include "scene/builtin/furniture.h"

#include <cmath>
#include <iterator>
#include <utility>

#include "scene/builtin/surface.h"

namespace lightcuts {
namespace {

/// A round leg that tapers to the floor, its top at `top`, its foot moved by `splay`.
void add_leg(Mesh& mesh, Vec3 top, Vec2 splay, float top_radius, float foot_radius) {
  Mesh leg;
  add_lathe(leg, {{0, 0}, {foot_radius, 0}, {foot_radius, 0.01f}, {top_radius, 1}, {0, 1}}, 16, {});
  append(mesh, leg, {{1, 0, 0}, {-splay.x, top.y, -splay.y}, {0, 0, 1}, {top.x + splay.x, 0, top.z + splay.y}});
}

/// A pillow: two domes that meet in a seam, w x h, upright in the plane z = 0.
void add_pillow(Mesh& mesh, float width, float height, float thickness, const Affine& place) {
  Mesh pillow;
  for (const float side : {1.0f, -1.0f}) {
    add_patch(pillow, 14, 14,
              [&](float u, float v) {
                const float x = 2 * u - 1, y = 2 * v - 1;
                const auto bulge = [](float t) { return std::pow(std::fmax(1 - t * t * t * t, 0.0f), 0.6f); };
                const float waist = 1 - 0.06f * (1 - x * x) * (y * y) - 0.06f * (1 - y * y) * (x * x);
                return Vec3{side * x * width / 2 * waist, y * height / 2 * waist,
                            side * (thickness / 2 * bulge(x) * bulge(y) + 0.002f)};
              },
              {width, height});
  }
  append(mesh, pillow, place);
}

/// Tilted back about the x axis by an angle [degrees], then turned and moved.
Affine leaning(float tilt_deg, float turn_deg, Vec3 origin) {
  const float a = tilt_deg * kPi / 180, c = std::cos(a), s = std::sin(a);
  return turned(turn_deg, origin) * Affine{{1, 0, 0}, {0, c, -s}, {0, s, c}, {}};
}

}  // namespace

Mesh& Assembly::of(std::uint32_t material) {
  for (Mesh& mesh : meshes_) {
    if (mesh.material == material) return mesh;
  }
  meshes_.emplace_back().material = material;
  return meshes_.back();
}

Piece Assembly::take(const std::string& name) {
  for (Mesh& mesh : meshes_) mesh.name = name;
  return {std::move_iterator(meshes_.begin()), std::move_iterator(meshes_.end())};
}

Piece make_sofa(const Palette& palette) {
  Assembly sofa;
  Mesh& cloth = sofa.of(palette.sofa);
  add_rounded_box(cloth, {{-1.12f, 0.14f, -0.44f}, {1.12f, 0.30f, 0.42f}}, 0.04f, 3);
  add_rounded_box(cloth, {{-1.12f, 0.20f, -0.46f}, {1.12f, 0.80f, -0.26f}}, 0.08f, 4);
  for (const float side : {-1.0f, 1.0f}) {
    const float x = side * 1.14f;
    add_rounded_box(cloth, {{x - 0.11f, 0.14f, -0.46f}, {x + 0.11f, 0.60f, 0.44f}}, 0.085f, 5);
  }
  for (int i = -1; i <= 1; ++i) {
    const float x = 0.68f * static_cast<float>(i);
    add_rounded_box(cloth, {{x - 0.335f, 0.29f, -0.27f}, {x + 0.335f, 0.47f, 0.45f}}, 0.06f, 4);
    Mesh back;
    add_rounded_box(back, {{-0.33f, 0, -0.10f}, {0.33f, 0.46f, 0.10f}}, 0.08f, 4);
    append(cloth, back, leaning(-12, 0, {x, 0.45f, -0.17f}));
  }
  add_pillow(sofa.of(palette.cushion_a), 0.46f, 0.46f, 0.20f, leaning(-24, 16, {-0.78f, 0.69f, 0.10f}));
  add_pillow(sofa.of(palette.cushion_b), 0.42f, 0.42f, 0.18f, leaning(-28, -6, {-0.45f, 0.66f, 0.17f}));
  add_pillow(sofa.of(palette.cushion_a), 0.46f, 0.46f, 0.20f, leaning(-24, -18, {0.80f, 0.69f, 0.10f}));
  for (const float x : {-1.0f, 1.0f}) {
    for (const float z : {-0.36f, 0.34f}) add_leg(sofa.of(palette.wood), {x, 0.15f, z}, {x * 0.03f, 0}, 0.03f, 0.018f);
  }
  return sofa.take("sofa");
}

Piece make_chair(const Palette& palette) {
  Assembly chair;
  Mesh& wood = chair.of(palette.wood);
  for (const float x : {-0.17f, 0.17f}) {
    add_leg(wood, {x, 0.44f, 0.17f}, {x * 0.2f, 0.03f}, 0.020f, 0.013f);
    add_leg(wood, {x, 0.44f, -0.17f}, {x * 0.2f, -0.05f}, 0.020f, 0.013f);
    Mesh post;
    add_lathe(post, {{0, 0}, {0.016f, 0}, {0.013f, 0.38f}, {0.009f, 0.395f}, {0, 0.40f}}, 14, {});
    append(wood, post, leaning(-10, 0, {x * 1.02f, 0.45f, -0.18f}));
  }
  add_rounded_box(wood, {{-0.215f, 0.43f, -0.21f}, {0.215f, 0.465f, 0.21f}}, 0.0165f, 3);
  add_rounded_box(chair.of(palette.linen), {{-0.20f, 0.462f, -0.19f}, {0.20f, 0.497f, 0.20f}}, 0.017f, 3);
  add_tube(
      wood, 32, 20,
      [](float u) {
        const float t = 2 * u - 1;
        return Vec3{0.25f * t, 0.80f, -0.275f + 0.07f * t * t};
      },
      [](float) {
        return Vec2{0.012f, 0.085f};
      },
      {0, 1, 0});
  return chair.take("chair");
}

Piece make_dining_table(const Palette& palette) {
  Assembly table;
  Mesh& wood = table.of(palette.wood);
  Mesh top;
  add_lathe(top, {{0, 0.715f}, {0.56f, 0.715f}, {0.60f, 0.725f}, {0.615f, 0.737f}, {0.60f, 0.75f}, {0, 0.75f}}, 72, {});
  append(wood, top, Affine{});
  add_lathe(wood,
            {{0, 0},
             {0.30f, 0},
             {0.31f, 0.02f},
             {0.29f, 0.04f},
             {0.12f, 0.07f},
             {0.065f, 0.13f},
             {0.05f, 0.3f},
             {0.05f, 0.5f},
             {0.07f, 0.64f},
             {0.16f, 0.715f}},
            40, {});
  return table.take("dining table");
}

Piece make_coffee_table(const Palette& palette) {
  Assembly table;
  Mesh& wood = table.of(palette.dark_wood);
  add_rounded_box(wood, {{-0.56f, 0.36f, -0.31f}, {0.56f, 0.40f, 0.31f}}, 0.018f, 3);
  add_rounded_box(wood, {{-0.47f, 0.14f, -0.24f}, {0.47f, 0.16f, 0.24f}}, 0.009f, 2);
  for (const float x : {-0.47f, 0.47f}) {
    for (const float z : {-0.23f, 0.23f}) add_leg(wood, {x, 0.365f, z}, {x * 0.08f, z * 0.08f}, 0.024f, 0.015f);
  }
  // A few books lie on it.
  float y = 0.401f;
  const float turn[] = {8, -5, 14};
  for (std::size_t i = 0; i < 3; ++i) {
    Mesh book;
    const float w = 0.13f - 0.012f * static_cast<float>(i), h = 0.028f;
    add_sharp_box(book, {{-w, 0, -w * 0.72f}, {w, h, w * 0.72f}});
    append(table.of(palette.books[i * 2 % palette.books.size()]), book, turned(turn[i], {-0.30f, y, 0.06f}));
    y += h + 0.001f;
  }
  return table.take("coffee table");
}

namespace {

/// A row of books between x and x_end, standing on y; their sizes come from a fixed little generator.
void add_books(Assembly& shelf, const Palette& palette, float x, float x_end, float y, std::uint32_t& state) {
  const auto next = [&state] {
    state = state * 1664525u + 1013904223u;
    return static_cast<float>(state >> 8) * 0x1p-24f;
  };
  while (true) {
    const float thickness = 0.018f + 0.035f * next(), height = 0.19f + 0.11f * next(), depth = 0.15f + 0.05f * next();
    if (x + thickness > x_end) return;
    const auto color = static_cast<std::size_t>(next() * static_cast<float>(palette.books.size()));
    const Box cover{{x, y, 0.10f - depth}, {x + thickness, y + height, 0.10f}};
    add_rounded_box(shelf.of(palette.books[color]), cover, 0.003f, 1);
    x += thickness + 0.002f;
  }
}

}  // namespace

Piece make_bookcase(const Palette& palette) {
  Assembly shelf;
  constexpr float kHalf = 0.60f, kHeight = 2.02f, kDepth = 0.15f;
  constexpr int kBoards = 6;
  Mesh& wood = shelf.of(palette.wood);
  for (const float side : {-1.0f, 1.0f}) {
    const float x = side * (kHalf - 0.0125f);
    add_rounded_box(wood, {{x - 0.0125f, 0, -kDepth}, {x + 0.0125f, kHeight, kDepth}}, 0.004f, 1);
  }
  const auto board_height = [](int i) { return 0.05f + static_cast<float>(i) * 0.385f; };
  for (int i = 0; i < kBoards; ++i) {
    const float y = board_height(i);
    add_rounded_box(wood, {{-kHalf + 0.0255f, y, -kDepth}, {kHalf - 0.0255f, y + 0.022f, kDepth - 0.004f}}, 0.004f, 1);
  }
  add_panel(wood, {-kHalf + 0.026f, 0.05f, -kDepth + 0.004f}, {2 * kHalf - 0.052f, 0, 0}, {0, kHeight - 0.07f, 0});

  std::uint32_t state = 2026;
  const float spans[][2] = {{-0.56f, 0.20f}, {-0.10f, 0.56f}, {-0.56f, 0.02f}, {-0.56f, 0.56f}, {0.04f, 0.56f}};
  for (int i = 0; i < kBoards - 1; ++i) {
    add_books(shelf, palette, spans[i][0], spans[i][1], board_height(i) + 0.0225f, state);
  }
  // Pots where there are no books.
  const auto on = [&](int board) { return board_height(board) + 0.0225f; };
  add_lathe(shelf.of(palette.glaze),
            {{0, 0}, {0.05f, 0}, {0.085f, 0.06f}, {0.09f, 0.11f}, {0.06f, 0.17f}, {0.03f, 0.20f}, {0.045f, 0.235f}}, 36,
            {-0.34f, on(1), 0});
  add_lathe(shelf.of(palette.porcelain),
            {{0, 0}, {0.04f, 0}, {0.10f, 0.05f}, {0.13f, 0.10f}, {0.123f, 0.10f}, {0.03f, 0.02f}, {0, 0.02f}}, 36,
            {0.28f, on(2), 0});
  add_lathe(shelf.of(palette.terracotta),
            {{0, 0}, {0.06f, 0}, {0.075f, 0.12f}, {0.05f, 0.20f}, {0.055f, 0.24f}, {0.05f, 0.24f}}, 36,
            {-0.38f, on(4), 0});
  add_ball(shelf.of(palette.metal), {-0.14f, on(4) + 0.08f, 0}, 0.08f, 32);
  add_lathe(shelf.of(palette.porcelain), {{0, 0}, {0.05f, 0}, {0.055f, 0.15f}, {0.02f, 0.22f}, {0.02f, 0.27f}}, 32,
            {0.40f, on(0), 0});
  return shelf.take("bookcase");
}

Piece make_floor_lamp(const Palette& palette) {
  Assembly lamp;
  add_lathe(lamp.of(palette.metal),
            {{0, 0},
             {0.16f, 0},
             {0.165f, 0.01f},
             {0.15f, 0.025f},
             {0.03f, 0.035f},
             {0.013f, 0.05f},
             {0.012f, 1.46f},
             {0, 1.46f}},
            36, {});
  // The cloth itself shines, outwards and through its ends.
  add_lathe(lamp.of(palette.shade), {{0, 1.38f}, {0.24f, 1.38f}, {0.17f, 1.72f}, {0, 1.72f}}, 40, {});
  return lamp.take("floor lamp");
}

Piece make_pendant(const Palette& palette) {
  Assembly pendant;
  add_ball(pendant.of(palette.globe), {0, 0, 0}, 0.17f, 40);
  add_lathe(pendant.of(palette.metal),
            {{0.05f, 0.164f}, {0.05f, 0.19f}, {0.02f, 0.21f}, {0.004f, 0.215f}, {0.004f, 1.10f}}, 20, {});
  return pendant.take("pendant");
}

Piece make_plant(const Palette& palette) {
  Assembly plant;
  add_lathe(plant.of(palette.porcelain),
            {{0, 0}, {0.14f, 0}, {0.16f, 0.02f}, {0.20f, 0.36f}, {0.205f, 0.38f}, {0.185f, 0.38f}, {0.18f, 0.33f}}, 44,
            {});
  add_lathe(plant.of(palette.earth), {{0.185f, 0.345f}, {0.08f, 0.36f}, {0, 0.362f}}, 32, {});
  constexpr int kLeaves = 34;
  for (int i = 0; i < kLeaves; ++i) {
    // The golden angle spreads them; the inner ones stand, the outer ones hang over.
    const float t = (static_cast<float>(i) + 0.5f) / kLeaves;
    const float reach = 0.25f + 0.50f * t, rise = 1.25f - 0.55f * t + 0.12f * std::sin(7.0f * static_cast<float>(i));
    const auto rib = [&](float u) {
      return Vec3{0, 0.34f + rise * u * (1.25f - 0.25f * u) - 0.9f * t * u * u * u * rise,
                  0.03f + reach * u * (0.3f + 0.7f * u)};
    };
    Mesh leaf;
    add_patch(leaf, 4, 12,
              [&](float a, float u) {
                // A narrow stalk, a wide blade, a tip.
                const float blade = std::sin(kPi * clamp_to(1.25f * u - 0.27f, 0.0f, 1.0f));
                const float width = 0.006f + 0.075f * blade;
                const float x = 2 * a - 1;
                return rib(u) + Vec3{-x * width, 0.25f * std::fabs(x) * width, 0};
              },
              {0.1f, 0.6f});
    append(plant.of(palette.leaf), leaf, turned(137.508f * static_cast<float>(i), {}));
  }
  return plant.take("plant");
}

Piece make_picture(const Palette& palette) {
  Assembly picture;
  constexpr float kWidth = 1.20f, kHeight = 0.90f, kFrame = 0.035f, kDepth = 0.03f;
  Mesh& frame = picture.of(palette.dark_wood);
  for (const float side : {-1.0f, 1.0f}) {
    const float x = side * (kWidth + kFrame) / 2, y = side * (kHeight + kFrame) / 2;
    add_rounded_box(frame,
                    {{x - kFrame / 2, -kHeight / 2 - kFrame, 0.001f}, {x + kFrame / 2, kHeight / 2 + kFrame, kDepth}},
                    0.006f, 2);
    add_rounded_box(frame, {{-kWidth / 2, y - kFrame / 2, 0.001f}, {kWidth / 2, y + kFrame / 2, kDepth}}, 0.006f, 2);
  }
  Mesh& canvas = picture.of(palette.painting);
  add_panel(canvas, {-kWidth / 2, -kHeight / 2, 0.012f}, {kWidth, 0, 0}, {0, kHeight, 0});
  for (Vec2& t : canvas.texcoords[0]) t = {t.x / kWidth, t.y / kHeight};
  return picture.take("picture");
}

Piece make_tea_set(const Palette& palette) {
  Assembly set;
  Mesh& pot = set.of(palette.porcelain);
  add_lathe(pot,
            {{0, 0.004f},
             {0.05f, 0.004f},
             {0.055f, 0},
             {0.06f, 0.008f},
             {0.085f, 0.035f},
             {0.095f, 0.07f},
             {0.085f, 0.105f},
             {0.058f, 0.128f},
             {0.056f, 0.134f},
             {0.05f, 0.138f},
             {0.03f, 0.15f},
             {0.012f, 0.155f},
             {0.009f, 0.162f},
             {0.014f, 0.170f},
             {0.010f, 0.180f},
             {0, 0.183f}},
            48, {});
  add_tube(
      pot, 24, 16,
      [](float u) {
        return Vec3{0.07f + 0.10f * u, 0.05f + 0.02f * u + 0.08f * u * u, 0};
      },
      [](float u) {
        return Vec2{0.021f - 0.012f * u, 0.019f - 0.010f * u};
      },
      {0, 0, 1});
  add_tube(
      pot, 28, 14,
      [](float u) {
        const float angle = kPi * (0.52f + 0.98f * u);
        return Vec3{-0.08f + 0.058f * std::cos(angle), 0.078f + 0.045f * std::sin(angle), 0};
      },
      [](float) {
        return Vec2{0.007f, 0.008f};
      },
      {0, 0, 1});
  for (const Vec3 place : {Vec3{0.02f, 0, 0.18f}, Vec3{0.22f, 0, 0.11f}}) {
    add_lathe(set.of(palette.porcelain),
              {{0, 0}, {0.035f, 0}, {0.068f, 0.012f}, {0.066f, 0.015f}, {0.03f, 0.005f}, {0, 0.005f}}, 32, place);
    add_lathe(
        set.of(palette.glaze),
        {{0, 0.006f}, {0.02f, 0.006f}, {0.034f, 0.03f}, {0.040f, 0.06f}, {0.037f, 0.06f}, {0.030f, 0.03f}, {0, 0.012f}},
        32, place);
  }
  return set.take("tea set");
}

Piece make_fruit_bowl(const Palette& palette) {
  Assembly bowl;
  add_lathe(bowl.of(palette.glaze),
            {{0, 0},
             {0.06f, 0},
             {0.06f, 0.012f},
             {0.12f, 0.045f},
             {0.155f, 0.09f},
             {0.148f, 0.09f},
             {0.11f, 0.05f},
             {0.04f, 0.022f},
             {0, 0.02f}},
            44, {});
  for (const Vec3 p : {Vec3{-0.05f, 0.067f, -0.02f}, Vec3{0.045f, 0.067f, -0.035f}, Vec3{0.005f, 0.070f, 0.055f},
                       Vec3{0, 0.125f, 0.002f}}) {
    add_ball(bowl.of(palette.orange), p, 0.040f, 28);
  }
  return bowl.take("fruit bowl");
}

Piece make_vase(const Palette& palette) {
  Assembly vase;
  add_lathe(vase.of(palette.glaze),
            {{0, 0},
             {0.045f, 0},
             {0.05f, 0.01f},
             {0.085f, 0.09f},
             {0.088f, 0.13f},
             {0.06f, 0.21f},
             {0.028f, 0.26f},
             {0.026f, 0.29f},
             {0.040f, 0.32f},
             {0.036f, 0.32f},
             {0.022f, 0.29f}},
            40, {});
  // Dry twigs.
  for (int i = 0; i < 7; ++i) {
    const float lean = 0.06f + 0.02f * static_cast<float>(i % 3),
                height = 0.30f + 0.05f * static_cast<float>((i * 3) % 5);
    Mesh twig;
    const auto stem = [&](float u) { return Vec3{lean * u * (1 + u), 0.26f + height * u, 0}; };
    add_tube(twig, 8, 6, stem, [](float u) { return Vec2{0.003f - 0.002f * u, 0.003f - 0.002f * u}; }, {0, 0, 1});
    for (int k = 4; k <= 9; ++k) {
      const float u = 0.1f * static_cast<float>(k) + 0.08f;
      add_ball(twig, stem(u) + Vec3{0, 0, 0.012f * static_cast<float>(k % 2 * 2 - 1)}, 0.011f, 10);
    }
    append(vase.of(palette.earth), twig, turned(51.4f * static_cast<float>(i), {}));
  }
  return vase.take("vase");
}

}  // namespace lightcuts
