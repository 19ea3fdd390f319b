#include "cpu/ism/map_plan.h"

#include <fmt/format.h>

#include <algorithm>

#include "cpu/ism/shadow_map_pool.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

constexpr std::uint64_t kBatchBytes = std::uint64_t{32} << 20;
/// Each kind of light may have one light more in a batch than in another, a point light with two maps.
constexpr std::uint64_t kUneven = 4;
constexpr std::uint64_t kFewestMaps = 2 * kUneven;
/// More maps of all lights are made for each picture anew: taking so much memory would cost most of what keeping saves.
constexpr std::uint64_t kMostKept = std::uint64_t{256} << 20;

}  // namespace

MapPlan plan_maps(const LightSet& lights, const PointOptions& points, const ShadowMapOptions& maps,
                  std::uint64_t budget) {
  const std::uint64_t per_map = MapBlocks::stride(maps);
  const std::uint64_t light_count = lights.vpls.size() + lights.points.size() + lights.directionals.size();
  const std::uint64_t fixed = SurfacePoints::bytes_for(points) + 8 * light_count;
  const std::uint64_t least = fixed + kFewestMaps * per_map;
  if (budget != 0 && budget < least) {
    throw Error(
        Code::out_of_memory,
        fmt::format("{} points and a few shadow maps of {}x{} texels need {} MiB, but {} MiB of the memory budget "
                    "are left; take fewer points, smaller maps or a larger budget",
                    SurfacePoints::count_for(points), maps.size, maps.size, (least >> 20) + 1, budget >> 20));
  }
  MapPlan plan;
  plan.maps = MapMaker::maps_of(lights);
  const std::uint64_t fits = budget == 0 ? plan.maps + kUneven : (budget - fixed) / per_map;
  const std::uint64_t at_once = std::max(kFewestMaps, std::min(fits, kBatchBytes / per_map)) - kUneven;
  plan.batches = static_cast<std::size_t>(std::max<std::uint64_t>(1, (plan.maps + at_once - 1) / at_once));
  const std::uint64_t all = (plan.maps + kUneven * plan.batches) * per_map + 4 * light_count * plan.batches;
  plan.keeps_all = all <= kMostKept && (budget == 0 || all <= budget - fixed);
  return plan;
}

std::size_t plan_pool(const LightSet& lights, const PointOptions& points, const ShadowMapOptions& maps, int threads,
                      std::uint64_t budget) {
  const std::uint64_t all = std::max<std::uint64_t>(1, MapMaker::maps_of(lights));
  const std::uint64_t least = 2 * static_cast<std::uint64_t>(threads);
  if (budget == 0) return std::max(all, least);
  const std::uint64_t per_map = ShadowMapPool::bytes_per_map(maps);
  const std::uint64_t fixed = SurfacePoints::bytes_for(points) + ShadowMapPool::kBytesPerLight * all;
  if (budget < fixed + least * per_map) {
    throw Error(
        Code::out_of_memory,
        fmt::format("{} points and {} shadow maps of {}x{} texels, two for each thread, need {} MiB, but {} MiB "
                    "of the memory budget are left; take fewer points, smaller maps or a larger budget",
                    SurfacePoints::count_for(points), least, maps.size, maps.size,
                    ((fixed + least * per_map) >> 20) + 1, budget >> 20));
  }
  return std::clamp((budget - fixed) / per_map, least, std::max(all, least));
}

}  // namespace lightcuts
