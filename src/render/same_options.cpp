#include "render/same_options.h"

#include <tuple>

namespace lightcuts {
namespace {

bool same(const Affine& a, const Affine& b) { return a.x == b.x && a.y == b.y && a.z == b.z && a.origin == b.origin; }

/// What a picture shows, whatever the camera is called.
bool same(const Camera& a, const Camera& b) {
  const auto rest = [](const Camera& c) { return std::tie(c.vertical_fov_rad, c.orthographic_height, c.aspect); };
  return same(a.world_from_camera, b.world_from_camera) && rest(a) == rest(b);
}

bool same(const PlacementView& a, const PlacementView& b) {
  const auto rest = [](const PlacementView& v) { return std::tie(v.width, v.height, v.min_distance); };
  return same(a.camera, b.camera) && rest(a) == rest(b);
}

}  // namespace

bool same_vpls(const VplOptions& a, const VplOptions& b) {
  const auto rest = [](const VplOptions& o) {
    return std::tie(o.count, o.primary_lights, o.vpls_per_light, o.bounces, o.deposit, o.deposit_distance, o.sequence,
                    o.placement, o.seed);
  };
  return rest(a) == rest(b) && a.view.has_value() == b.view.has_value() && (!a.view || same(*a.view, *b.view));
}

bool same_trees(const TreeOptions& a, const TreeOptions& b) {
  const auto all = [](const TreeOptions& o) { return std::tie(o.builder, o.metric, o.seed); };
  return all(a) == all(b);
}

bool same_backend(const RenderOptions& a, const RenderOptions& b) {
  const auto all = [](const RenderOptions& o) { return std::tie(o.backend, o.device, o.memory_bytes, o.threads); };
  return all(a) == all(b);
}

}  // namespace lightcuts
