#include <cmath>

#include "scene/builtin/builtin.h"
#include "scene/builtin/furniture.h"
#include "scene/builtin/shapes.h"
#include "scene/builtin/surface.h"
#include "scene/builtin/textures.h"

// A living room of 6 x 2.8 x 7 m with a wall of windows towards -x: the picture of the README and of the demo.
// x to the right, y up, z towards the viewer.

namespace lightcuts {
namespace {

constexpr Box kRoom{{-3, 0, -3.5f}, {3, 2.8f, 3.5f}};
constexpr float kWallThickness = 0.22f;
constexpr Box kWindow{{-3 - kWallThickness, 0.30f, -2.75f}, {-3, 2.45f, 2.65f}};

// ---- materials

std::uint32_t add_textured(Scene& scene, const std::string& name, Vec3 tint, TextureImage image, Vec2 size) {
  const std::uint32_t index = add_material(scene, name, tint);
  TextureRef& texture = scene.materials[index].base_color_texture;
  texture.image = static_cast<std::uint32_t>(scene.images.size());
  texture.uv_transform = {1 / size.x, 0, 0, 0, 1 / size.y, 0};
  scene.images.push_back(std::move(image));
  return index;
}

/// Another tint of a texture that is there already.
std::uint32_t add_tinted(Scene& scene, const std::string& name, Vec3 tint, std::uint32_t like) {
  const std::uint32_t index = add_material(scene, name, tint);
  scene.materials[index].base_color_texture = scene.materials[like].base_color_texture;
  return index;
}

Palette make_palette(Scene& scene, bool lamp_light) {
  Palette p{};
  p.wall = add_textured(scene, "plaster", {0.80f, 0.77f, 0.71f}, plaster(), {2, 2});
  p.accent_wall = add_tinted(scene, "sage plaster", {0.30f, 0.38f, 0.34f}, p.wall);
  p.ceiling = add_tinted(scene, "ceiling", {0.84f, 0.83f, 0.80f}, p.wall);
  p.white_paint = add_material(scene, "white paint", {0.80f, 0.79f, 0.76f});
  p.planks = add_textured(scene, "planks", {1, 1, 1}, wood_planks(), {2.4f, 2.4f});
  p.tiles = add_textured(scene, "tiles", {1, 1, 1}, floor_tiles(), {0.6f, 0.6f});
  p.wood = add_textured(scene, "oak", {1, 1, 1}, wood_grain(), {1.2f, 1.2f});
  p.dark_wood = add_tinted(scene, "walnut", {0.45f, 0.38f, 0.34f}, p.wood);
  p.linen = add_textured(scene, "linen", {0.78f, 0.73f, 0.64f}, linen(), {0.1f, 0.1f});
  p.sofa = add_tinted(scene, "sofa cloth", {0.62f, 0.36f, 0.20f}, p.linen);
  p.cushion_a = add_tinted(scene, "cushion cream", {0.80f, 0.74f, 0.62f}, p.linen);
  p.cushion_b = add_tinted(scene, "cushion blue", {0.14f, 0.24f, 0.34f}, p.linen);
  p.rug = add_textured(scene, "rug", {1, 1, 1}, rug(), {1, 1});
  p.painting = add_textured(scene, "painting", {1, 1, 1}, painting(), {1, 1});
  p.metal = add_material(scene, "brass", {0.55f, 0.42f, 0.22f});
  p.porcelain = add_material(scene, "porcelain", {0.80f, 0.78f, 0.74f});
  p.glaze = add_material(scene, "blue glaze", {0.14f, 0.30f, 0.38f});
  p.terracotta = add_material(scene, "terracotta", {0.60f, 0.30f, 0.18f});
  p.leaf = add_material(scene, "leaf", {0.16f, 0.32f, 0.11f});
  p.earth = add_material(scene, "earth", {0.20f, 0.14f, 0.10f});
  p.orange = add_material(scene, "orange", {0.78f, 0.36f, 0.10f});
  p.paper = add_material(scene, "paper", {0.75f, 0.72f, 0.65f});
  const Vec3 warm{1.0f, 0.62f, 0.30f};
  p.shade = add_material(scene, "lamp shade", {0.7f, 0.6f, 0.45f}, warm * (lamp_light ? 22.0f : 9.0f));
  p.globe = add_material(scene, "globe", {0.7f, 0.7f, 0.7f}, Vec3{1.0f, 0.70f, 0.40f} * (lamp_light ? 40.0f : 3.0f));
  for (const Vec3 color : {Vec3{0.60f, 0.22f, 0.15f},
                           {0.14f, 0.24f, 0.34f},
                           {0.70f, 0.62f, 0.48f},
                           {0.22f, 0.36f, 0.30f},
                           {0.72f, 0.48f, 0.18f},
                           {0.40f, 0.38f, 0.36f},
                           {0.32f, 0.14f, 0.18f},
                           {0.76f, 0.73f, 0.66f}}) {
    p.books.push_back(add_material(scene, "book", color));
  }
  return p;
}

void draw(Scene& scene, Piece piece, const std::vector<Affine>& places) {
  for (Mesh& mesh : piece) {
    for (const Affine& place : places) {
      scene.instances.push_back({mesh.name, static_cast<std::uint32_t>(scene.meshes.size()), place});
    }
    scene.meshes.push_back(std::move(mesh));
  }
}

// ---- the room

/// The wall of windows: what is left of the wall around the opening, inside and outside, and the reveals between.
void add_window_wall(Mesh& wall) {
  const float y0 = kWindow.lo.y, y1 = kWindow.hi.y, z0 = kWindow.lo.z, z1 = kWindow.hi.z;
  const float top = kRoom.hi.y, front = kRoom.hi.z, back = kRoom.lo.z;
  const auto inside = [&](float za, float zb, float ya, float yb) {
    add_panel(wall, {kRoom.lo.x, ya, zb}, {0, 0, za - zb}, {0, yb - ya, 0});
  };
  const auto outside = [&](float za, float zb, float ya, float yb) {
    add_panel(wall, {kWindow.lo.x, ya, za}, {0, 0, zb - za}, {0, yb - ya, 0});
  };
  for (const auto& side : {0, 1}) {
    const auto both = [&](float za, float zb, float ya, float yb) {
      side == 0 ? inside(za, zb, ya, yb) : outside(za, zb, ya, yb);
    };
    both(back, z0, 0, top);
    both(z1, front, 0, top);
    both(z0, z1, 0, y0);
    both(z0, z1, y1, top);
  }
  const Vec3 across{kWallThickness, 0, 0};
  add_panel(wall, {kWindow.lo.x, y0, z1}, across, {0, 0, z0 - z1});
  add_panel(wall, {kWindow.lo.x, y1, z0}, across, {0, 0, z1 - z0});
  add_panel(wall, {kWindow.lo.x, y0, z0}, across, {0, y1 - y0, 0});
  add_panel(wall, {kRoom.lo.x, y0, z1}, -across, {0, y1 - y0, 0});
}

/// Posts and a rail of the windows, and the sill.
void add_window_frames(Mesh& paint, Mesh& sill) {
  const float x = kWindow.lo.x + 0.09f, y0 = kWindow.lo.y, y1 = kWindow.hi.y, z0 = kWindow.lo.z, z1 = kWindow.hi.z;
  const auto bar = [&](float ya, float yb, float za, float zb) {
    add_rounded_box(paint, {{x - 0.03f, ya, za}, {x + 0.03f, yb, zb}}, 0.006f, 2);
  };
  constexpr int kPanes = 5;
  for (int i = 0; i <= kPanes; ++i) {
    const float z = z0 + 0.03f + (z1 - z0 - 0.06f) * static_cast<float>(i) / kPanes;
    bar(y0 + 0.001f, y1 - 0.001f, z - 0.028f, z + 0.028f);
  }
  bar(y0 + 0.002f, y0 + 0.06f, z0 + 0.002f, z1 - 0.002f);
  bar(y1 - 0.06f, y1 - 0.002f, z0 + 0.002f, z1 - 0.002f);
  bar(1.92f, 1.965f, z0 + 0.002f, z1 - 0.002f);
  add_rounded_box(sill, {{kRoom.lo.x - 0.10f, y0 + 0.002f, z0 + 0.002f}, {kRoom.lo.x + 0.10f, y0 + 0.03f, z1 - 0.002f}},
                  0.008f, 2);
}

void add_shell(Scene& scene, const Palette& palette) {
  Assembly room;
  const Vec3 lo = kRoom.lo, hi = kRoom.hi, size = hi - lo;
  constexpr float kTiles = 0.9f;  // a strip of tiles along the windows
  add_panel(room.of(palette.tiles), {lo.x - kWallThickness, 0, hi.z}, {kTiles + kWallThickness, 0, 0}, {0, 0, -size.z});
  add_panel(room.of(palette.planks), {lo.x + kTiles, 0, hi.z}, {size.x - kTiles, 0, 0}, {0, 0, -size.z});
  add_panel(room.of(palette.ceiling), {lo.x - kWallThickness, hi.y, lo.z}, {size.x + kWallThickness, 0, 0},
            {0, 0, size.z});
  add_panel(room.of(palette.accent_wall), lo, {size.x, 0, 0}, {0, size.y, 0});
  add_panel(room.of(palette.wall), {hi.x, 0, lo.z}, {0, 0, size.z}, {0, size.y, 0});
  add_panel(room.of(palette.wall), {hi.x, 0, hi.z}, {-size.x, 0, 0}, {0, size.y, 0});
  for (const float z : {lo.z, hi.z}) {
    // Close the wall's thickness at both ends.
    const float sign = z < 0 ? 1.0f : -1.0f;
    add_panel(room.of(palette.wall), {sign > 0 ? lo.x - kWallThickness : lo.x, 0, z}, {sign * kWallThickness, 0, 0},
              {0, size.y, 0});
  }
  add_window_wall(room.of(palette.wall));
  Mesh paint, sill;
  add_window_frames(paint, sill);
  append(room.of(palette.white_paint), paint, Affine{});
  append(room.of(palette.wood), sill, Affine{});

  // Skirting boards and beams.
  Mesh& boards = room.of(palette.white_paint);
  add_rounded_box(boards, {{lo.x + 0.001f, 0.001f, lo.z + 0.001f}, {hi.x - 0.001f, 0.10f, lo.z + 0.016f}}, 0.005f, 2);
  add_rounded_box(boards, {{hi.x - 0.016f, 0.001f, lo.z + 0.017f}, {hi.x - 0.001f, 0.10f, hi.z - 0.001f}}, 0.005f, 2);
  for (int i = 0; i < 5; ++i) {
    const float z = -2.6f + 1.3f * static_cast<float>(i);
    add_rounded_box(room.of(palette.wood),
                    {{lo.x + 0.001f, hi.y - 0.16f, z - 0.06f}, {hi.x - 0.001f, hi.y - 0.001f, z + 0.06f}}, 0.008f, 2);
  }
  draw(scene, room.take("room"), {Affine{}});
}

/// A curtain that hangs in folds from y = 2.6 between two z, its front towards the room.
void add_curtain(Scene& scene, const Palette& palette, float z0, float z1, float folds) {
  Assembly curtain;
  add_patch(curtain.of(palette.linen), 90, 10,
            [&](float u, float v) {
              const float depth = 0.035f + 0.02f * (1 - v);
              const float sway = 0.6f * std::sin(5 * v + 9 * u);
              return Vec3{-2.88f + depth * std::sin(2 * kPi * folds * u + sway * 0.4f), 0.015f + 2.585f * v,
                          z1 + (z0 - z1) * (u + 0.01f * std::sin(6 * v))};
            },
            {1.2f, 2.6f});
  draw(scene, curtain.take("curtain"), {Affine{}});
}

void add_rug(Scene& scene, const Palette& palette) {
  Mesh mesh;
  add_rounded_box(mesh, {{-1.38f, 0.001f, -0.92f}, {1.38f, 0.014f, 0.92f}}, 0.006f, 2);
  for (std::size_t i = 0; i < mesh.texcoords[0].size(); ++i) {
    const Vec3 p = mesh.positions[i];
    mesh.texcoords[0][i] = {(p.x + 1.38f) / 2.76f, (p.z + 0.92f) / 1.84f};
  }
  add_mesh(scene, std::move(mesh), "rug", palette.rug);
  scene.instances.back().world_from_object = turned(0, {0.75f, 0, -1.55f});
}

void furnish(Scene& scene, const Palette& palette) {
  add_rug(scene, palette);
  add_curtain(scene, palette, -3.42f, -2.72f, 6);
  add_curtain(scene, palette, 2.62f, 3.42f, 6);
  draw(scene, make_sofa(palette), {turned(0, {0.85f, 0, -2.85f})});
  draw(scene, make_picture(palette), {turned(0, {0.85f, 1.62f, kRoom.lo.z})});
  draw(scene, make_floor_lamp(palette), {turned(0, {2.52f, 0, -2.95f})});
  draw(scene, make_bookcase(palette), {turned(0, {-1.30f, 0, -3.32f})});
  draw(scene, make_plant(palette), {turned(20, {-2.42f, 0, -2.55f})});
  draw(scene, make_coffee_table(palette), {turned(0, {0.80f, 0.014f, -1.50f})});
  draw(scene, make_tea_set(palette), {turned(-20, {0.98f, 0.415f, -1.55f})});

  // The dining corner by the window.
  const Vec3 table{-1.45f, 0, 0.15f};
  draw(scene, make_dining_table(palette), {turned(0, table)});
  draw(scene, make_chair(palette),
       {turned(100, table + Vec3{-0.78f, 0, 0.12f}), turned(195, table + Vec3{0.16f, 0, 0.80f}),
        turned(-72, table + Vec3{0.80f, 0, -0.20f}), turned(-8, table + Vec3{-0.10f, 0, -0.80f})});
  draw(scene, make_fruit_bowl(palette), {turned(30, table + Vec3{0.14f, 0.7505f, 0.10f})});
  draw(scene, make_vase(palette), {turned(0, table + Vec3{-0.20f, 0.7505f, -0.14f})});
  draw(scene, make_pendant(palette), {turned(0, table + Vec3{0, 1.70f, 0})});
}

// ---- light

/// What the windows show, as radiances.
struct Landscape {
  Vec3 zenith, horizon, far_hills, near_hills, meadow;
};

/// Height of a range of hills above the horizon [degrees] in a direction; whole waves, so that it closes.
float crest(float azimuth, float height, float phase) {
  return height * (1 + 0.35f * std::sin(5 * azimuth + phase) + 0.25f * std::sin(11 * azimuth + 2 * phase) +
                   0.08f * std::sin(37 * azimuth + 3 * phase));
}

/// Radiance from outside at an elevation [degrees] and an azimuth [rad]. Outlines are as soft as a few pixels are wide.
Vec3 landscape_radiance(const Landscape& land, float elevation, float azimuth) {
  const auto above = [&](float edge) { return clamp_to(0.5f + (elevation - edge) / 1.2f, 0.0f, 1.0f); };
  const auto over = [](Vec3 below, Vec3 top, float t) { return below + (top - below) * t; };
  const float height = std::sin(max_of(elevation, 0.0f) * kPi / 180);
  Vec3 color = over(land.meadow, land.near_hills, above(-2));
  color = over(color, land.far_hills, above(crest(azimuth, 2.5f, 4.0f)));
  return over(color, over(land.horizon, land.zenith, std::sqrt(height)), above(crest(azimuth, 7.5f, 1.0f)));
}

/// An equirectangular picture of the landscape; a third of a degree a pixel.
std::shared_ptr<const Image> paint_landscape(const Landscape& land) {
  constexpr int kWidth = 1024, kHeight = 512;
  auto image = std::make_shared<Image>(make_rgb_image(kWidth, kHeight));
  for (int y = 0; y < kHeight; ++y) {
    const float elevation = 90 - 180 * (static_cast<float>(y) + 0.5f) / kHeight;
    for (int x = 0; x < kWidth; ++x) {
      const float azimuth = 2 * kPi * (static_cast<float>(x) + 0.5f) / kWidth;
      const Vec3 color = landscape_radiance(land, elevation, azimuth);
      const auto pixel = static_cast<std::size_t>(y * kWidth + x);
      for (int c = 0; c < 3; ++c) image->channels[static_cast<std::size_t>(c)].values[pixel] = component(color, c);
    }
  }
  return image;
}

void add_daylight(Scene& scene) {
  scene.directional_lights.push_back({normalize(Vec3{0.80f, -0.52f, -0.30f}), Vec3{1.0f, 0.86f, 0.66f} * 34.0f});
  const Landscape land{
      {1.3f, 2.4f, 4.4f}, {2.9f, 3.4f, 3.9f}, {1.0f, 1.4f, 1.7f}, {0.36f, 0.58f, 0.30f}, {0.70f, 0.88f, 0.40f}};
  scene.environment = Environment{{1, 1, 1}, paint_landscape(land)};
}

void add_dusk(Scene& scene) {
  const Landscape land{{0.08f, 0.15f, 0.40f},
                       {0.75f, 0.50f, 0.48f},
                       {0.16f, 0.17f, 0.30f},
                       {0.05f, 0.06f, 0.09f},
                       {0.06f, 0.07f, 0.08f}};
  scene.environment = Environment{{1, 1, 1}, paint_landscape(land)};
}

void add_camera(Scene& scene, const char* name, Vec3 eye, Vec3 target, float vertical_fov_deg) {
  Camera camera = look_at(eye, target, vertical_fov_deg * kPi / 180);
  camera.name = name;
  camera.aspect = 1.6f;
  scene.cameras.push_back(camera);
}

}  // namespace

Scene make_interior(const BuiltinOptions& options) {
  const bool lamp_light = options.choice("light", {"sun", "lamp"}) == "lamp";
  Scene scene;
  const Palette palette = make_palette(scene, lamp_light);
  add_shell(scene, palette);
  furnish(scene, palette);
  lamp_light ? add_dusk(scene) : add_daylight(scene);

  add_camera(scene, "room", {1.95f, 1.45f, 3.25f}, {-0.42f, 0.98f, -1.6f}, 46);
  add_camera(scene, "table", {0.55f, 1.35f, 1.75f}, {-1.55f, 0.78f, 0.05f}, 42);
  add_camera(scene, "sofa", {0.15f, 1.3f, 0.95f}, {0.95f, 0.74f, -2.6f}, 42);
  add_camera(scene, "window", {2.75f, 1.6f, -2.3f}, {-1.6f, 0.85f, 0.5f}, 50);
  scene.width = 1280;
  scene.height = 800;
  return scene;
}

}  // namespace lightcuts
