#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "lightcuts/scene.h"

namespace lightcuts {
namespace {

/// FNV-1a over the bytes of numbers.
class Fnv {
 public:
  template <class T>
  void add(const T& value) {
    unsigned char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    for (const unsigned char byte : bytes) hash_ = (hash_ ^ byte) * 1099511628211u;
  }
  [[nodiscard]] std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 14695981039346656037u;
};

std::uint64_t hash_of(const Scene& scene) {
  Fnv hash;
  for (const Mesh& mesh : scene.meshes) {
    for (const Vec3 p : mesh.positions) hash.add(p);
    for (const auto& triangle : mesh.triangles) hash.add(triangle);
    hash.add(mesh.material);
  }
  for (const Material& material : scene.materials) {
    hash.add(material.base_color);
    hash.add(material.emission);
  }
  return hash.value();
}

std::vector<Mesh> boxes_of(const Scene& scene) {
  std::vector<Mesh> boxes;
  std::copy_if(scene.meshes.begin(), scene.meshes.end(), std::back_inserter(boxes),
               [](const Mesh& mesh) { return mesh.name == "box"; });
  return boxes;
}

/// Interval that a mesh covers along a direction.
std::pair<float, float> extent(const Mesh& mesh, Vec3 direction) {
  float lo = std::numeric_limits<float>::infinity(), hi = -lo;
  for (const Vec3 p : mesh.positions) {
    lo = std::min(lo, dot(p, direction));
    hi = std::max(hi, dot(p, direction));
  }
  return {lo, hi};
}

/// Two boxes turned about the vertical axis are apart iff some face normal separates them (separating axis theorem).
bool are_apart(const Mesh& a, const Mesh& b) {
  for (const Mesh* mesh : {&a, &b}) {
    for (const auto& t : mesh->triangles) {
      const Vec3 corner = mesh->positions[t[0]];
      const Vec3 normal = normalize(cross(mesh->positions[t[1]] - corner, mesh->positions[t[2]] - corner));
      const auto [a_lo, a_hi] = extent(a, normal);
      const auto [b_lo, b_hi] = extent(b, normal);
      if (a_hi + 0.05f < b_lo || b_hi + 0.05f < a_lo) return true;
    }
  }
  return false;
}

TEST(Study, IsTheSameRoomEverywhere) {
  EXPECT_EQ(hash_of(make_builtin_scene("study")), 7058516303761067914u)
      << "the study's room must never change: figures of different versions are compared in it";
}

TEST(Study, HasTheStudysSizes) {
  const Scene scene = make_builtin_scene("study");
  const Box room = scene_bounds(scene);
  EXPECT_EQ(room.hi - room.lo, (Vec3{10, 5, 10}));
  EXPECT_EQ(boxes_of(scene).size(), 40u);
  for (const Material& material : scene.materials) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_GE(component(material.base_color, axis), 0.2f);
      EXPECT_LE(component(material.base_color, axis), 0.7f);
    }
  }
  const auto lamp = std::find_if(scene.meshes.begin(), scene.meshes.end(),
                                 [&](const Mesh& mesh) { return scene.materials[mesh.material].emission.x > 0; });
  EXPECT_EQ(extent(*lamp, {1, 0, 0}), std::make_pair(-1.0f, 1.0f));
  EXPECT_EQ(extent(*lamp, {0, 1, 0}), std::make_pair(5.0f, 5.0f));
  EXPECT_EQ(extent(*lamp, {0, 0, 1}), std::make_pair(-1.0f, 1.0f));
}

TEST(Study, ItsBoxesTouchNothing) {
  const Scene scene = make_builtin_scene("study");
  const std::vector<Mesh> boxes = boxes_of(scene);
  int standing = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) EXPECT_TRUE(are_apart(boxes[i], boxes[k])) << k << " and " << i;
    for (const Vec3 axis : {Vec3{1, 0, 0}, Vec3{0, 0, 1}}) {
      EXPECT_GT(extent(boxes[i], axis).first, -4.9f);
      EXPECT_LT(extent(boxes[i], axis).second, 4.9f);
    }
    const auto [bottom, top] = extent(boxes[i], {0, 1, 0});
    EXPECT_TRUE(bottom == 0 || bottom > 0.9f);
    EXPECT_LT(top, 4.9f);
    standing += bottom == 0 ? 1 : 0;
  }
  EXPECT_EQ(standing, 24);
}

TEST(Study, TheViewIsOpen) {
  const Scene scene = make_builtin_scene("study");
  const Affine camera = scene.cameras[0].world_from_camera;
  for (const Mesh& box : boxes_of(scene)) {
    for (const Vec3 p : box.positions) EXPECT_GT(length(p - camera.origin), 2);
  }
}

}  // namespace
}  // namespace lightcuts
