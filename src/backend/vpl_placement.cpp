#include "backend/vpl_placement.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "backend/vpl_plan.h"
#include "kernels/light_key.h"

namespace lightcuts {
namespace {

constexpr std::uint64_t kCandidatesEach = 16;
constexpr std::uint64_t kMostCandidates = 1u << 24;  ///< 600 MB
constexpr double kBlocks = 16;
constexpr double kFloorShare = 0.2;  ///< of the mean worth: no VPL is brighter than six ordinary ones of its path
constexpr float kClamp = 0.03f;      ///< of the scene's diagonal: about the distance between points

/// Scale s such that the sum of min(1, s worth) is `wanted`. Caps are found one round after the other; each can only
/// raise the scale, so this ends.
double probability_scale(const std::vector<double>& worth, double wanted) {
  double scale = 0;
  for (;;) {
    double capped = 0, open = 0;
    for (const double w : worth) {
      if (w * scale >= 1) {
        ++capped;
      } else {
        open += w;
      }
    }
    if (!(open > 0) || capped >= wanted) return scale;
    const double next = (wanted - capped) / open;
    if (!(next > scale * (1 + 1e-12))) return scale;
    scale = next;
  }
}

}  // namespace

std::uint64_t placement_candidates(std::uint64_t wanted) {
  return std::clamp(kMostCandidates, 2 * wanted, kCandidatesEach * wanted);
}

PlacementGrid make_placement_grid(int width, int height) {
  const double aspect = static_cast<double>(width) / height;
  const auto count = [](double blocks) {
    return static_cast<std::uint32_t>(std::clamp(std::round(blocks), 1.0, kBlocks));
  };
  const std::uint32_t rows = count(std::sqrt(kBlocks / aspect));
  return {count(kBlocks / rows), rows};
}

float placement_clamp(float min_distance, float diagonal) { return std::max(min_distance, kClamp) * diagonal; }

std::vector<float> placement_weights(const std::vector<PlacementPoint>& points, const std::vector<double>& radiance) {
  double mean = 0, count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!(points[i].reflectance > 0)) continue;
    mean += points[i].seen + radiance[i];
    ++count;
  }
  std::vector<float> weights(points.size(), 0.0f);
  if (!(mean > 0)) return weights;
  mean /= count;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double l = points[i].seen + radiance[i];
    if (points[i].reflectance > 0) weights[i] = static_cast<float>(1 / std::sqrt(l * l + 0.01 * mean * mean));
  }
  return weights;
}

std::vector<std::uint32_t> placement_order(const Lights& lights) {
  const std::size_t vpls = lights.vpls.size();
  Box bounds;
  for (const Vpl& vpl : lights.vpls) bounds = extend(bounds, vpl.position);
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys(vpls + lights.sky_count);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const bool sky = i >= vpls;
    const Vec3 place = sky ? lights.directionals[i - vpls].direction : lights.vpls[i].position;
    keys[i] = {light_key(place, sky ? Vec3{} : lights.vpls[i].axis, sky ? Box{{-1, -1, -1}, {1, 1, 1}} : bounds, {}),
               static_cast<std::uint32_t>(i)};
  }
  const auto at = [&](std::uint64_t i) { return keys.begin() + static_cast<std::ptrdiff_t>(i); };
  std::sort(keys.begin(), at(lights.primary_count));
  std::sort(at(lights.primary_count), at(vpls));
  std::sort(at(vpls), keys.end());
  std::vector<std::uint32_t> order(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) order[i] = keys[i].second;
  return order;
}

std::vector<KeptLight> keep_by_worth(const std::vector<float>& worth, const std::vector<std::uint32_t>& order,
                                     std::uint64_t wanted, double start) {
  std::vector<KeptLight> kept;
  if (worth.size() <= wanted) {
    kept.reserve(worth.size());
    for (std::size_t i = 0; i < worth.size(); ++i) kept.push_back({static_cast<std::uint32_t>(i), 1.0f});
    return kept;
  }
  double mean = 0;
  for (const float w : worth) mean += w;
  mean /= static_cast<double>(worth.size());
  std::vector<double> guarded(worth.size());
  for (std::size_t i = 0; i < worth.size(); ++i) guarded[i] = mean > 0 ? worth[i] / mean + kFloorShare : 1.0;

  const double scale = probability_scale(guarded, static_cast<double>(wanted));
  kept.reserve(wanted + 1);
  double before = start;
  for (const std::uint32_t i : order) {
    const double probability = std::min(1.0, guarded[i] * scale), after = before + probability;
    if (std::floor(after) > std::floor(before)) {
      kept.push_back({i, static_cast<float>(1 / probability)});
    }
    before = after;
  }
  std::sort(kept.begin(), kept.end(), [](const KeptLight& a, const KeptLight& b) { return a.index < b.index; });
  return kept;
}

std::vector<KeptLight> choose_for_camera(const std::vector<float>& worth, const Lights& lights,
                                         const VplOptions& options) {
  const double start = philox(0, 0, 0, derive_seed(options.seed, placement_choice)).unit_double(0);
  return keep_by_worth(worth, placement_order(lights), options.count, start);
}

void keep_lights(const std::vector<KeptLight>& kept, Lights& lights) {
  const std::size_t vpls = lights.vpls.size(), sky = lights.sky_count;
  const std::uint64_t primary = lights.primary_count;
  std::vector<Vpl> chosen;
  std::vector<DirectionalLight> directionals;
  chosen.reserve(kept.size());
  lights.primary_count = 0;
  for (const KeptLight& k : kept) {
    if (k.index < vpls) {
      chosen.push_back(lights.vpls[k.index]);
      chosen.back().intensity *= k.weight;
      if (k.index < primary) ++lights.primary_count;
    } else {
      directionals.push_back(lights.directionals[k.index - vpls]);
      directionals.back().irradiance *= k.weight;
    }
  }
  lights.sky_count = directionals.size();
  directionals.insert(directionals.end(), lights.directionals.begin() + static_cast<std::ptrdiff_t>(sky),
                      lights.directionals.end());
  lights.vpls = std::move(chosen);
  lights.directionals = std::move(directionals);
}

}  // namespace lightcuts
