#include "cpu/vpl_placement.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <mutex>

#include "backend/vpl_placement.h"
#include "backend/vpl_plan.h"
#include "cpu/light_set.h"
#include "cpu/simd/isa.h"
#include "cpu/simd/shade_kernels.h"

namespace lightcuts {
namespace {

constexpr std::size_t kChunk = 256;  ///< candidates that one task rates
constexpr std::size_t kSampleStride = kPlacementStride;

void set(PacketVec3& packet, int lane, Vec3 v) {
  packet.x[lane] = v.x;
  packet.y[lane] = v.y;
  packet.z[lane] = v.z;
}

std::vector<ReceiverPacket> make_packets(const std::vector<PlacementPoint>& points) {
  std::vector<ReceiverPacket> packets(points.size() / kPlacementBlock);
  for (std::size_t i = 0; i < points.size(); ++i) {
    ReceiverPacket& packet = packets[i / kPlacementBlock];
    const auto lane = static_cast<int>(i % kPlacementBlock);
    set(packet.position, lane, points[i].position);
    set(packet.ns, lane, points[i].ns);
    set(packet.ng, lane, points[i].ng);
    if (points[i].reflectance > 0) packet.active |= 1u << lane;
  }
  return packets;
}

/// What single lights bring to the points.
class Rating {
 public:
  Rating(const RayTracer& tracer, const LightSet& lights, std::vector<PlacementPoint> points, float clamp)
      : tracer_(tracer),
        kernels_(shade_kernels(selected_isa())),
        lights_(lights),
        points_(std::move(points)),
        packets_(make_packets(points_)),
        clamp_sq_(clamp * clamp) {}

  [[nodiscard]] const std::vector<PlacementPoint>& points() const { return points_; }

  /// Calls add(point, luminance of the reflected radiance) for every point that the light reaches. VPLs come first,
  /// then directional lights, then point lights.
  template <class Add>
  void contributions(std::size_t light, Add add) const {
    const std::size_t vpls = lights_.vpls.size(), directionals = lights_.directionals.size();
    if (light < vpls) {
      const Vpl& vpl = lights_.vpls[light];
      visit(luminance(vpl.intensity), add,
            [&](const ReceiverPacket& packet, PacketFactors& factors, RayPacket16& rays) {
              return kernels_.vpl_shadow_rays(packet, vpl, clamp_sq_, factors, rays);
            });
    } else if (light < vpls + directionals) {
      const DirectionalRecord& sun = lights_.directionals[light - vpls];
      visit(luminance(sun.irradiance), add,
            [&](const ReceiverPacket& packet, PacketFactors& factors, RayPacket16& rays) {
              return kernels_.directional_shadow_rays(packet, sun, factors, rays);
            });
    } else {
      const PointRecord& point = lights_.points[light - vpls - directionals];
      visit(luminance(point.intensity), add,
            [&](const ReceiverPacket& packet, PacketFactors& factors, RayPacket16& rays) {
              return kernels_.point_shadow_rays(packet, point, factors, rays);
            });
    }
  }

 private:
  template <class Add, class Rays>
  void visit(float power, Add& add, const Rays& rays_of) const {
    PacketFactors factors;
    RayPacket16 rays;
    for (std::size_t p = 0; p < packets_.size(); ++p) {
      const std::uint32_t lit = rays_of(packets_[p], factors, rays) & packets_[p].active;
      if (lit == 0) continue;
      for (std::uint32_t seen = lit & ~tracer_.occluded16(rays, lit); seen != 0; seen &= seen - 1) {
        const auto lane = static_cast<std::size_t>(std::countr_zero(seen));
        const std::size_t point = p * kPlacementBlock + lane;
        add(point, power * factors.clamped[lane] * points_[point].reflectance);
      }
    }
  }

  const RayTracer& tracer_;
  const ShadeKernels& kernels_;
  const LightSet& lights_;
  std::vector<PlacementPoint> points_;
  std::vector<ReceiverPacket> packets_;
  float clamp_sq_;
};

std::vector<PlacementPoint> trace_points(const SceneView& scene, const RayTracer& tracer, const VplOptions& options) {
  const PlacementView& view = *options.view;
  const PlacementGrid grid = make_placement_grid(view.width, view.height);
  const CameraView camera = make_camera_view(view.camera, view.width, view.height);
  const std::uint64_t seed = derive_seed(options.seed, placement_points);
  std::vector<PlacementPoint> points(std::size_t{grid.block_count()} * kPlacementBlock);
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    points[i] = trace_placement_point(scene, tracer, camera, grid, i, seed);
  }
  return points;
}

/// Luminance of what each point reflects of all lights, estimated from every sixteenth.
std::vector<double> estimate_radiance(const Rating& rating, std::size_t light_count) {
  const std::size_t samples = (light_count + kSampleStride - 1) / kSampleStride;
  const std::size_t chunks = (samples + kChunk - 1) / kChunk, points = rating.points().size();
  std::vector<double> parts(chunks * points, 0.0);
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t c) {
    for (std::size_t s = c * kChunk; s < std::min(samples, (c + 1) * kChunk); ++s) {
      rating.contributions(s * kSampleStride, [&](std::size_t point, float radiance) {
        parts[c * points + point] += static_cast<double>(radiance) * kSampleStride;
      });
    }
  });
  std::vector<double> sum(points, 0.0);
  for (std::size_t i = 0; i < parts.size(); ++i) sum[i % points] += parts[i];
  return sum;
}

/// The worth of the first `count` lights; empty where asked to stop.
std::vector<float> rate(const Rating& rating, const std::vector<float>& weights, std::size_t count,
                        const ProgressFn& progress) {
  std::vector<float> worth(count, 0.0f);
  const std::size_t chunks = (count + kChunk - 1) / kChunk;
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stop{false};
  std::mutex reporting;
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t c) {
    if (stop) return;
    for (std::size_t i = c * kChunk; i < std::min(count, (c + 1) * kChunk); ++i) {
      double squares = 0;
      rating.contributions(i, [&](std::size_t point, float radiance) {
        const double share = static_cast<double>(radiance) * weights[point];
        squares += share * share;
      });
      worth[i] = static_cast<float>(std::sqrt(squares));
    }
    const std::size_t now = ++done;
    if (progress) {
      const std::lock_guard<std::mutex> one_at_a_time(reporting);
      if (!stop && !progress("vpls", static_cast<double>(now) / static_cast<double>(chunks))) stop = true;
    }
  });
  if (stop) return {};
  return worth;
}

}  // namespace

bool place_for_camera(const SceneView& scene, const RayTracer& tracer, const VplOptions& options,
                      const ProgressFn& progress, Lights& lights) {
  const std::size_t candidates = lights.vpls.size() + lights.sky_count;
  if (candidates <= options.count) return true;
  std::vector<float> worth;
  {
    const LightSet set = make_light_set(lights);
    const Rating rating(tracer, set, trace_points(scene, tracer, options),
                        placement_clamp(options.view->min_distance, scene.diagonal));
    const std::vector<double> radiance = estimate_radiance(rating, lights.count());
    worth = rate(rating, placement_weights(rating.points(), radiance), candidates, progress);
  }
  if (worth.empty()) return false;
  keep_lights(choose_for_camera(worth, lights, options), lights);
  return true;
}

}  // namespace lightcuts
