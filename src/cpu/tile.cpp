#include "cpu/tile.h"

#include <limits>

#include "cpu/ray_tracer.h"
#include "kernels/pixel_sample.h"

namespace lightcuts {
namespace {

void set(PacketVec3& packet, int lane, Vec3 v) {
  packet.x[lane] = v.x;
  packet.y[lane] = v.y;
  packet.z[lane] = v.z;
}

void add_surface(SurfacePacket& packet, int lane, const Surface& surface) {
  ReceiverPacket& receivers = packet.receivers;
  set(receivers.position, lane, surface.position);
  set(receivers.ns, lane, surface.ns);
  set(receivers.ng, lane, surface.ng);
  receivers.active |= 1u << lane;
  receivers.flat = receivers.flat && surface.ns == surface.ng;
  set(packet.albedo, lane, surface.albedo);
  set(packet.seen, lane, surface.emission);
}

}  // namespace

View make_view(const Camera& camera, int width, int height, std::uint32_t sample_count, std::uint64_t seed,
               bool centred) {
  return {make_camera_view(camera, width, height),
          normalize(transform_vector(camera.world_from_camera, {0, 0, -1})),
          width,
          height,
          sample_count,
          seed,
          centred};
}

Tile trace_tile(const View& view, int x0, int y0, std::uint32_t sample, const SceneView& scene, const RayTracer& tracer,
                const EmitterView& emitters) {
  Tile tile{};
  tile.x0 = x0;
  tile.y0 = y0;
  for (int p = 0; p < kTilePackets; ++p) {
    SurfacePacket& packet = tile.packets[static_cast<std::size_t>(p)];
    packet.receivers.flat = true;
    for (int lane = 0; lane < kPacketSize; ++lane) {
      const int x = x0 + tile_x(p, lane), y = y0 + tile_y(p, lane);
      if (x >= view.width || y >= view.height) continue;
      packet.inside_picture |= 1u << lane;
      packet.depth[lane] = std::numeric_limits<float>::infinity();

      const Vec2 at = sample_position(view.seed, view.width, x, y, sample, view.centred);
      const Ray ray = camera_ray(view.camera, at.x, at.y);
      const Hit hit = tracer.intersect(ray);
      if (hit.valid()) {
        add_surface(packet, lane, surface_at(scene, hit, ray.direction));
        packet.depth[lane] = hit.t * dot(ray.direction, view.axis);
      } else if (emitters.environment_count > 0) {
        set(packet.seen, lane, eval_environment(emitters.environment, ray.direction));
      }
    }
  }
  return tile;
}

}  // namespace lightcuts
