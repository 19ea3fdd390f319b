#include "cuda/light_by_maps.h"

#include <fmt/format.h>

#include <algorithm>

#include "lightcuts/error.h"

namespace lightcuts::cuda {
namespace {

std::uint64_t lights_in(const LightSpan& span) {
  return std::uint64_t{span.vpl_last} - span.vpl_first + span.point_last - span.point_first + span.directional_last -
         span.directional_first;
}

}  // namespace

std::uint64_t most_maps(const LightArrays& lights) {
  return std::uint64_t{lights.vpl_count} + 2 * std::uint64_t{lights.point_count} + lights.directional_count;
}

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
  const std::uint64_t even = 2 * std::uint64_t{kSumBlockLights};
  if (fits < all && fits > even) fits -= fits % even;
  return static_cast<std::uint32_t>(fits);
}

MapLighter::MapLighter(Device& device, const DevicePoints& points, const LightArrays& lights, const MapOptions& options,
                       std::uint64_t budget)
    : device_(&device), points_(&points), lights_(lights), options_(options) {
  const std::uint32_t at_once =
      plan_maps_at_once(budget, DeviceMaps::fixed_bytes(device, options, lights) + kSumByMapsBytes,
                        DeviceMaps::bytes_per_map(options), most_maps(lights), options.size);
  maps_.emplace(device, options, lights, at_once);
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
  StageTimer timer(*device_, "shadow maps");
  maps_->clear();
  const PointsView& points = points_->view();
  maps_->add_vpls(points, {nullptr, span.vpl_first, span.vpl_last - span.vpl_first});
  maps_->add_points(points, {nullptr, span.point_first, span.point_last - span.point_first});
  maps_->add_directionals(points, {nullptr, span.directional_first, span.directional_last - span.directional_first});
  made_ += maps_->count();
  milliseconds_ += timer.ms();
}

bool MapLighter::light(const PixelGrid& grid, const PixelView& pixels, float min_distance, const SumView& sums,
                       const std::function<bool(double)>& go_on) {
  const LightSpan all{0, lights_.vpl_count, 0, lights_.point_count, 0, lights_.directional_count};
  std::uint64_t done = 0;
  looked_up_ = rounds_ = 0;
  for (LightSpan span = next_span({}); lights_in(span) > 0; span = next_span(span)) {
    if (!all_made_) make(span);
    looked_up_ += maps_->count();
    ++rounds_;
    done += lights_in(span);
    sum_lights_by_maps(*device_, grid, pixels, lights_, span, maps_->view(), min_distance, sums);
    all_made_ = lights_in(span) == lights_in(all);
    if (done < lights_in(all) && !go_on(static_cast<double>(done) / static_cast<double>(lights_in(all)))) return false;
  }
  return true;
}

void MapLighter::report(Statistics& statistics) const {
  statistics.shadow_maps.size = options_.size;
  statistics.shadow_maps.count = looked_up_;
  statistics.shadow_maps.bytes = maps_->bytes();
  statistics.shadow_maps.room = maps_->capacity();
  statistics.shadow_maps.rounds = rounds_;
}

}  // namespace lightcuts::cuda
