#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "lightcuts/error.h"
#include "lightcuts/scene.h"

namespace lightcuts {
namespace {

constexpr float kAutomaticFov = 0.9f;

/// Calls `visit` with the corners of every triangle in world space.
template <class Visit>
void for_each_triangle(const Scene& scene, Visit visit) {
  for (const Instance& instance : scene.instances) {
    const Mesh& mesh = scene.meshes[instance.mesh];
    for (const auto& t : mesh.triangles) {
      visit(transform_point(instance.world_from_object, mesh.positions[t[0]]),
            transform_point(instance.world_from_object, mesh.positions[t[1]]),
            transform_point(instance.world_from_object, mesh.positions[t[2]]));
    }
  }
}

/// Share of each side of the box (-x, +x, -y, +y, -z, +z) that is covered by triangles near it which face inwards.
std::array<float, 6> inward_coverage(const Scene& scene, Box box) {
  const Vec3 size = box.hi - box.lo;
  std::array<double, 6> area{};
  for_each_triangle(scene, [&](Vec3 a, Vec3 b, Vec3 c) {
    const Vec3 doubled = cross(b - a, c - a);
    const Vec3 middle = (a + b + c) / 3.0f;
    for (int axis = 0; axis < 3; ++axis) {
      const float inward = component(doubled, axis);
      const float place =
          (component(middle, axis) - component(box.lo, axis)) / std::fmax(component(size, axis), 1e-30f);
      if (place < 0.15f && inward > 0) area[static_cast<std::size_t>(2 * axis)] += 0.5 * inward;
      if (place > 0.85f && inward < 0) area[static_cast<std::size_t>(2 * axis + 1)] -= 0.5 * inward;
    }
  });
  std::array<float, 6> coverage{};
  for (std::size_t side = 0; side < 6; ++side) {
    const int axis = static_cast<int>(side / 2);
    const float whole = component(size, (axis + 1) % 3) * component(size, (axis + 2) % 3);
    coverage[side] = whole > 0 ? static_cast<float>(area[side] / whole) : 0;
  }
  return coverage;
}

/// A room: at least five sides of its box face inwards over half their area. A house seen from outside faces outwards.
bool is_room(const std::array<float, 6>& coverage) {
  return std::count_if(coverage.begin(), coverage.end(), [](float share) { return share >= 0.5f; }) >= 5;
}

/// Distance from a point to the nearest corner or middle of a triangle; stands for the room there is about it.
std::vector<float> clearances(const Scene& scene, const std::vector<Vec3>& points) {
  std::vector<float> nearest_sq(points.size(), std::numeric_limits<float>::infinity());
  for_each_triangle(scene, [&](Vec3 a, Vec3 b, Vec3 c) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3 p = points[i];
      const float d = min_of(min_of(length_sq(a - p), length_sq(b - p)),
                             min_of(length_sq(c - p), length_sq((a + b + c) / 3.0f - p)));
      nearest_sq[i] = min_of(nearest_sq[i], d);
    }
  });
  return nearest_sq;
}

/// Looks across a room from whichever of its corners and sides has the most space about it, an open side preferred.
Camera camera_inside(const Scene& scene, Box box, const std::array<float, 6>& coverage) {
  const Vec3 half = (box.hi - box.lo) * 0.5f;
  std::vector<Vec3> eyes;
  for (const float z : {0.85f, -0.85f, 0.0f}) {
    for (const float x : {0.0f, 0.8f, -0.8f}) {
      if (x == 0 && z == 0) continue;
      eyes.push_back(center(box) + Vec3{x * half.x, 0.1f * half.y, z * half.z});
    }
  }
  Vec3 eye;
  if (const auto open = std::find_if(coverage.begin(), coverage.end(), [](float share) { return share < 0.5f; });
      open != coverage.end()) {
    const auto side = static_cast<std::size_t>(open - coverage.begin());
    const float sign = side % 2 == 0 ? -0.95f : 0.95f;
    const Vec3 axis = side / 2 == 0 ? Vec3{half.x, 0, 0} : side / 2 == 1 ? Vec3{0, half.y, 0} : Vec3{0, 0, half.z};
    eye = center(box) + axis * sign;
  } else {
    const std::vector<float> space = clearances(scene, eyes);
    eye = eyes[static_cast<std::size_t>(std::max_element(space.begin(), space.end()) - space.begin())];
  }
  return look_at(eye, center(box) - Vec3{0, 0.1f * half.y, 0}, 1.1f);
}

/// Three-quarter view from outside in which the bounding sphere fits.
Camera camera_outside(const Scene& scene, Box box) {
  const float radius = std::fmax(0.5f * diagonal(box), 1e-6f);
  const bool portrait = scene.width > 0 && scene.height > scene.width;
  const float aspect = portrait ? static_cast<float>(scene.width) / static_cast<float>(scene.height) : 1;
  const float narrow_half = std::atan(aspect * std::tan(kAutomaticFov / 2));
  const Vec3 from = normalize(Vec3{0.6f, 0.45f, 1});
  return look_at(center(box) + from * (radius / std::sin(narrow_half)), center(box), kAutomaticFov);
}

Camera frame(const Scene& scene) {
  const Box box = scene_bounds(scene);
  if (is_empty(box)) return look_at({0, 0, 1}, {0, 0, 0}, kAutomaticFov);
  const auto coverage = inward_coverage(scene, box);
  Camera camera = is_room(coverage) ? camera_inside(scene, box, coverage) : camera_outside(scene, box);
  camera.name = "automatic";
  return camera;
}

std::string list_of(const std::vector<Camera>& cameras) {
  if (cameras.empty()) return "the scene has no cameras";
  std::string list = "those of the scene are";
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    list += fmt::format("{} {}", i == 0 ? "" : ",", i);
    if (!cameras[i].name.empty()) list += fmt::format(" \"{}\"", cameras[i].name);
  }
  return list;
}

}  // namespace

Camera select_camera(const Scene& scene, const std::string& which) {
  if (which.empty()) return scene.cameras.empty() ? frame(scene) : scene.cameras.front();

  const auto named = std::find_if(scene.cameras.begin(), scene.cameras.end(),
                                  [&](const Camera& camera) { return camera.name == which; });
  if (named != scene.cameras.end()) return *named;

  std::size_t index = 0;
  const char* end = which.data() + which.size();
  const auto [rest, error] = std::from_chars(which.data(), end, index);
  if (error == std::errc{} && rest == end && index < scene.cameras.size()) return scene.cameras[index];
  throw Error(Code::invalid_argument, fmt::format("there is no camera \"{}\"; {}.", which, list_of(scene.cameras)));
}

}  // namespace lightcuts
