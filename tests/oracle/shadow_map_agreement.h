#pragma once

#include <algorithm>
#include <random>
#include <vector>

#include "backend/scene_arrays.h"
#include "cpu/ism/shadow_map_set.h"
#include "cpu/ray_tracer.h"
#include "kernels/surface.h"
#include "math/warp.h"

namespace lightcuts::oracle {

/// How often a shadow map says of a light and a point what a ray says; "lit" is a share above one half.
struct Agreement {
  double pairs = 0, lit = 0, wrongly_lit = 0, wrongly_dark = 0;
  double at_edges = 0, wrong_at_edges = 0;  ///< pairs (and wrong ones) within two texels of a shadow's edge

  [[nodiscard]] double agreement() const { return 1 - (wrongly_lit + wrongly_dark) / pairs; }
  [[nodiscard]] double always_lit() const { return lit / pairs; }
  /// Mean of the shares of lit and of dark pairs that were recognised.
  [[nodiscard]] double balanced() const {
    const double dark = pairs - lit;
    return 0.5 * ((lit > 0 ? 1 - wrongly_dark / lit : 1) + (dark > 0 ? 1 - wrongly_lit / dark : 1));
  }
};

/// Points of the scene's triangles, by area, on their front sides.
class ReceiverSampler {
 public:
  ReceiverSampler(const SceneView& scene, unsigned seed) : scene_(scene), engine_(seed) {
    for (std::uint32_t i = 0; i < scene.instance_count; ++i) {
      for (std::uint32_t t = 0; t < scene.meshes[scene.instances[i].mesh].triangle_count; ++t) {
        total_ += triangle_geometry(scene, i, t).area;
        triangles_.push_back({total_, i, t});
      }
    }
  }
  struct Point {
    Vec3 position, normal;
  };
  Point draw() {
    std::uniform_real_distribution<double> unit(0, 1);
    const double at = unit(engine_) * total_;
    const auto found = std::min(std::upper_bound(triangles_.begin(), triangles_.end(), at,
                                                 [](double v, const Entry& e) { return v < e.area_up_to; }),
                                triangles_.end() - 1);
    const TriangleGeometry g = triangle_geometry(scene_, found->instance, found->triangle);
    const Vec2 b = sample_triangle({static_cast<float>(unit(engine_)), static_cast<float>(unit(engine_))});
    return {point_on_triangle(g, b.x, b.y, g.front), g.front};
  }

 private:
  struct Entry {
    double area_up_to;
    std::uint32_t instance, triangle;
  };
  const SceneView& scene_;
  std::mt19937 engine_;
  std::vector<Entry> triangles_;
  double total_ = 0;
};

/// Whether some ray to a place about two texels around the point, on its plane, disagrees with the one to it.
inline bool at_shadow_edge(const RayTracer& tracer, const MapView& view, int size, Vec3 at, Vec3 normal, bool visible) {
  const float width = 2 * (view.half_width > 0 ? 2 * view.half_width / static_cast<float>(size)
                                               : 4 * length(at - view.origin) / static_cast<float>(size));
  const Frame frame = make_frame(normal);
  for (int k = 0; k < 8; ++k) {
    const float angle = 0.785398f * static_cast<float>(k);
    const Vec3 moved = at + frame.x * (width * std::cos(angle)) + frame.y * (width * std::sin(angle));
    if (tracer.occluded(shadow_ray(moved, view.origin)) == visible) return true;
  }
  return false;
}

/// Share of light by a map whose depths are those of rays through the texels' centres.
inline float exact_map_share(const RayTracer& tracer, const MapView& view, int size, Vec3 position, Vec3 normal) {
  const auto fetch = [&](int x, int y) -> std::uint16_t {
    const float u = texel_centre(x, size), v = texel_centre(y, size);
    if (u * u + v * v >= view.rim_sq) return kNoDepth<std::uint16_t>;
    const Hit hit = tracer.intersect({view.origin, 0, to_world(view.frame, unproject_paraboloid(u, v)), view.far});
    if (!hit.valid()) return kNoDepth<std::uint16_t>;
    return encode_depth<std::uint16_t>(hit.t, kDepthSteps<std::uint16_t> / view.far);
  };
  const Vec3 local = to_local_point(view, position), across = to_local_vector(view.frame, normal);
  return lookup_visibility<std::uint16_t>(view, local, across, size, fetch);
}

/// Compares the maps of every `step`-th VPL with rays to `per_light` random points that face it.
/// @param exact  asks maps of traced depths instead: what as many points as one likes would give
inline Agreement measure_agreement(const ShadowMapSet& maps, const LightSet& lights, const SceneArrays& scene,
                                   const RayTracer& tracer, std::size_t step, int per_light, bool edges = false,
                                   bool exact = false) {
  Agreement result;
  ReceiverSampler sampler(scene.view(), 1);
  for (std::size_t light = 0; light < lights.vpls.size(); light += step) {
    const auto id = static_cast<std::uint32_t>(light);
    const Vpl& vpl = lights.vpls[light];
    if (!maps.has(LightKind::vpl, id)) continue;
    const MapView view = maps.view_of(LightKind::vpl, id);
    for (int drawn = 0; drawn < per_light;) {
      ReceiverPacket packet{};
      packet.active = 0xffff;
      ReceiverSampler::Point points[kPacketSize];
      int tries = 0;
      for (int lane = 0; lane < kPacketSize && tries < 10000;) {
        ++tries;
        const ReceiverSampler::Point p = sampler.draw();
        const Vec3 to_light = offset_point(vpl.position, vpl.axis) - p.position;
        if (dot(to_light, vpl.axis) >= 0 || dot(to_light, p.normal) <= 0) continue;
        packet.position.x[lane] = p.position.x;
        packet.position.y[lane] = p.position.y;
        packet.position.z[lane] = p.position.z;
        packet.ng.x[lane] = p.normal.x;
        packet.ng.y[lane] = p.normal.y;
        packet.ng.z[lane] = p.normal.z;
        points[lane++] = p;
      }
      if (tries == 10000) break;
      alignas(64) float share[kPacketSize];
      maps.shares(LightKind::vpl, id, packet, 0xffff, share);
      for (int lane = 0; lane < kPacketSize; ++lane, ++drawn) {
        const bool visible = !tracer.occluded(shadow_ray(points[lane].position, offset_point(vpl.position, vpl.axis)));
        if (exact) {
          share[lane] =
              exact_map_share(tracer, view, maps.maker().options().size, points[lane].position, points[lane].normal);
        }
        const bool lit = share[lane] > 0.5f;
        result.pairs += 1;
        result.lit += visible ? 1 : 0;
        result.wrongly_lit += lit && !visible ? 1 : 0;
        result.wrongly_dark += !lit && visible ? 1 : 0;
        if (!edges) continue;
        const bool edge = at_shadow_edge(tracer, view, maps.maker().options().size, points[lane].position,
                                         points[lane].normal, visible);
        result.at_edges += edge ? 1 : 0;
        result.wrong_at_edges += edge && lit != visible ? 1 : 0;
      }
    }
  }
  return result;
}

}  // namespace lightcuts::oracle
