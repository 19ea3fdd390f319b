#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "lightcuts/lights.h"

namespace lightcuts::oracle {

/// A point of a surface that is lit: position, normal, luminance of its albedo.
struct RoomPoint {
  Vec3 position, normal;
  float albedo = 0.5f;
};

/// A closed room, 10 x 5 x 10 m, of axis-parallel boxes with a 2 x 2 m lamp in the ceiling: lights and receivers for tests
/// and benchmarks of trees and cuts, made by a few lines of photon tracing that share nothing with the renderer.
class SyntheticRoom {
 public:
  explicit SyntheticRoom(std::uint64_t seed, int box_count = 40) : random_(seed) {
    for (int i = 0; i < box_count; ++i) {
      const Vec3 half{0.15f + 0.45f * uniform(), 0.15f + 0.45f * uniform(), 0.15f + 0.45f * uniform()};
      const bool floats = uniform() < 0.4f;
      const Vec3 middle{1 + 8 * uniform(), floats ? 1 + 2.5f * uniform() : half.y, 1 + 8 * uniform()};
      const float hue = uniform();
      boxes_.push_back({{middle - half, middle + half}, {0.2f + 0.5f * hue, 0.5f, 0.7f - 0.5f * hue}});
    }
  }

  [[nodiscard]] static float diagonal() { return 15.0f; }

  /// `count` lights: a quarter on the lamp, the others where photons hit.
  std::vector<Vpl> lights(std::size_t count) {
    std::vector<Vpl> lights;
    const std::size_t primary = std::max<std::size_t>(count / 4, 1);
    const Vec3 lamp_power = Vec3{1, 0.9f, 0.7f} * (40 * kPi);
    for (std::size_t i = 0; i < primary; ++i)
      lights.push_back({lamp_point(), {0, -1, 0}, lamp_power / (kPi * static_cast<float>(primary))});
    const Vec3 photon = lamp_power / static_cast<float>(count);
    while (lights.size() < count) trace(photon, count, lights);
    return lights;
  }

  /// A random point of some wall or box, as a camera in the room sees them.
  RoomPoint receiver() {
    for (;;) {
      Hit hit;
      const Vec3 eye{1 + 8 * uniform(), 1 + 3 * uniform(), 1 + 8 * uniform()};
      if (inside_box(eye)) continue;
      const float z = 1 - 2 * uniform(), phi = 2 * kPi * uniform(), r = std::sqrt(1 - z * z);
      intersect(eye, {r * std::cos(phi), r * std::sin(phi), z}, hit);
      return {hit.position, hit.normal, luminance(hit.albedo)};
    }
  }

  float uniform() { return static_cast<float>(static_cast<double>(random_() >> 11) * 0x1.0p-53); }

 private:
  struct Block {
    Box box;
    Vec3 albedo;
  };
  struct Hit {
    Vec3 position, normal, albedo;
  };

  Vec3 lamp_point() { return {4 + 2 * uniform(), 4.999f, 4 + 2 * uniform()}; }

  [[nodiscard]] bool inside_box(Vec3 p) const {
    return std::any_of(boxes_.begin(), boxes_.end(), [&](const Block& b) {
      return p.x > b.box.lo.x && p.y > b.box.lo.y && p.z > b.box.lo.z && p.x < b.box.hi.x && p.y < b.box.hi.y &&
             p.z < b.box.hi.z;
    });
  }

  static float& at(Vec3& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

  void intersect(Vec3 origin, Vec3 direction, Hit& hit) const {
    // The room from inside.
    float nearest = 1e30f;
    const Vec3 size{10, 5, 10};
    for (int k = 0; k < 3; ++k) {
      const float d = component(direction, k), o = component(origin, k);
      if (std::abs(d) < 1e-9f) continue;
      const float t = ((d > 0 ? component(size, k) : 0.0f) - o) / d;
      if (t >= nearest) continue;
      nearest = t;
      hit.normal = {};
      at(hit.normal, k) = d > 0 ? -1.0f : 1.0f;
      hit.albedo = k == 0 ? (d > 0 ? Vec3{0.6f, 0.1f, 0.1f} : Vec3{0.1f, 0.6f, 0.1f}) : Vec3{0.6f, 0.6f, 0.6f};
    }
    // Boxes from outside.
    for (const Block& b : boxes_) {
      float enter = 0, leave = nearest;
      int side = -1;
      for (int k = 0; k < 3; ++k) {
        const float inverse = 1 / component(direction, k), o = component(origin, k);
        float t0 = (component(b.box.lo, k) - o) * inverse, t1 = (component(b.box.hi, k) - o) * inverse;
        if (t0 > t1) std::swap(t0, t1);
        if (t0 > enter) enter = t0, side = k;
        leave = std::min(leave, t1);
      }
      if (side < 0 || enter >= leave) continue;
      nearest = enter;
      hit.normal = {};
      at(hit.normal, side) = component(direction, side) > 0 ? -1.0f : 1.0f;
      hit.albedo = b.albedo;
    }
    hit.position = origin + direction * nearest + hit.normal * 1e-4f;
  }

  Vec3 cosine_direction(Vec3 n) {
    const float z = 1 - 2 * uniform(), phi = 2 * kPi * uniform(), r = std::sqrt(1 - z * z);
    return normalize(n * 1.0001f + Vec3{r * std::cos(phi), r * std::sin(phi), z});
  }

  void trace(Vec3 flux, std::size_t count, std::vector<Vpl>& lights) {
    Vec3 position = lamp_point(), normal{0, -1, 0};
    for (int bounce = 0; bounce < 64 && lights.size() < count; ++bounce) {
      Hit hit;
      intersect(position, cosine_direction(normal), hit);
      flux = flux * hit.albedo;
      lights.push_back({hit.position, hit.normal, flux * kInvPi});
      const float survival = std::min(0.95f, max_component(hit.albedo));
      if (uniform() >= survival) return;
      flux = flux / survival;
      position = hit.position;
      normal = hit.normal;
    }
  }

  std::mt19937_64 random_;
  std::vector<Block> boxes_;
};

}  // namespace lightcuts::oracle
