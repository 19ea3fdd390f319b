#include "cuda/light_by_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "lightcuts/error.h"

namespace lightcuts::cuda {
namespace {

constexpr std::uint32_t kBlockLights = 256;  ///< as sum_lights_by_maps sums them

/// At most: every point light counted twice.
std::uint64_t most_maps(const LightArrays& lights) {
  return std::uint64_t{lights.vpl_count} + 2 * std::uint64_t{lights.point_count} + lights.directional_count;
}

std::uint64_t lights_in(const LightSpan& span) {
  return std::uint64_t{span.vpl_last} - span.vpl_first + span.point_last - span.point_first + span.directional_last -
         span.directional_first;
}

}  // namespace

std::uint32_t plan_maps_at_once(std::uint64_t budget, std::uint64_t fixed, std::uint64_t per_map, std::uint64_t all,
                                int size) {
  // A point light has two.
  const std::uint64_t least = std::min<std::uint64_t>(all, 2), most = 0x7fffffffu;
  if (budget < fixed + least * per_map) {
    throw Error(
        Code::out_of_memory,
        fmt::format("the points of the surfaces and one light's shadow maps of {}x{} texels need {} MiB of GPU "
                    "memory, but {} MiB of the budget are left; give a larger --memory, fewer --ism-points or a "
                    "smaller --ism-size",
                    size, size, ((fixed + least * per_map) >> 20) + 1, budget >> 20));
  }
  std::uint64_t fits = std::min<std::uint64_t>({(budget - fixed) / per_map, all, most});
  const std::uint64_t even = 2 * std::uint64_t{kBlockLights};
  if (fits < all && fits > even) fits -= fits % even;
  return static_cast<std::uint32_t>(fits);
}

MapLighter::MapLighter(Device& device, const SceneView& scene, const DeviceEdges& edges, const LightArrays& lights,
                       const ShadeOptions& options, std::uint64_t budget)
    : device_(&device), lights_(lights), size_(options.ism_size) {
  const MapOptions maps = map_options(options);
  const auto per_map = static_cast<std::uint32_t>(options.ism_points);
  const std::uint64_t fixed =
      DevicePoints::bytes_for(per_map, edges.triangle_count()) + DeviceMaps::fixed_bytes(device, maps, lights);
  const std::uint32_t at_once =
      plan_maps_at_once(budget, fixed, DeviceMaps::bytes_per_map(maps), most_maps(lights), options.ism_size);
  const auto start = std::chrono::steady_clock::now();
  points_.emplace(device, scene, edges, per_map, options.seed);
  maps_.emplace(device, maps, lights, at_once);
  device.synchronize();
  milliseconds_ = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

/// The lights after a span that there is room for; empty after the last. All at once, or of one kind.
LightSpan MapLighter::next_span(const LightSpan& before) const {
  const std::uint32_t room = maps_->capacity();
  LightSpan span{before.vpl_last,   before.vpl_last,         before.point_last,
                 before.point_last, before.directional_last, before.directional_last};
  if (room >= most_maps(lights_)) {
    return {span.vpl_first,      lights_.vpl_count,      span.point_first,
            lights_.point_count, span.directional_first, lights_.directional_count};
  }
  if (span.vpl_first < lights_.vpl_count) {
    span.vpl_last += std::min(room, lights_.vpl_count - span.vpl_first);
  } else if (span.point_first < lights_.point_count) {
    span.point_last += std::min(room / 2, lights_.point_count - span.point_first);
  } else {
    span.directional_last += std::min(room, lights_.directional_count - span.directional_first);
  }
  return span;
}

void MapLighter::make(const LightSpan& span) {
  const auto start = std::chrono::steady_clock::now();
  maps_->clear();
  const PointsView& points = points_->view();
  maps_->add_vpls(points, {nullptr, span.vpl_first, span.vpl_last - span.vpl_first});
  maps_->add_points(points, {nullptr, span.point_first, span.point_last - span.point_first});
  maps_->add_directionals(points, {nullptr, span.directional_first, span.directional_last - span.directional_first});
  device_->synchronize();
  milliseconds_ += std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

bool MapLighter::light(const PixelGrid& grid, const PixelView& pixels, float min_distance, const SumView& sums,
                       const std::function<bool(double)>& go_on) {
  const LightSpan all{0, lights_.vpl_count, 0, lights_.point_count, 0, lights_.directional_count};
  std::uint64_t made = 0, done = 0;
  for (LightSpan span = next_span({}); lights_in(span) > 0; span = next_span(span)) {
    if (!all_made_) make(span);
    made += maps_->count();
    done += lights_in(span);
    sum_lights_by_maps(*device_, grid, pixels, lights_, span, maps_->view(), min_distance, sums);
    all_made_ = lights_in(span) == lights_in(all);
    if (done < lights_in(all) && !go_on(static_cast<double>(done) / static_cast<double>(lights_in(all)))) return false;
  }
  made_ = made;
  return true;
}

void MapLighter::report(Statistics& statistics) const {
  statistics.shadow_maps.size = size_;
  statistics.shadow_maps.count = made_;
  statistics.shadow_maps.bytes = maps_->bytes();
  statistics.time_ms.shadow_maps = milliseconds_;
}

}  // namespace lightcuts::cuda
