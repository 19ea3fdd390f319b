// What it would give to spend more of a map's points where its light sees closer or larger surface.

#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <vector>

#include "cpu/ism/fill_holes.h"
#include "cpu/simd/isa.h"
#include "kernels/draw_map.h"
#include "measurements.h"
#include "oracle/shadow_map_agreement.h"
#include "oracle/tally.h"
#include "pictures.h"

namespace lightcuts {
namespace {

constexpr int kSize = 64;

/// What a surface's points are worth to a light.
enum class Worth {
  block,  ///< the same everywhere, behind the light too: a block of the order, as maps are made
  even,   ///< the same everywhere before the light
  light,  ///< the projected solid angle of an area: what it gets of the light
  texels  ///< the texels that it covers
};
struct Spending {
  const char* name;
  Worth worth;
  float least;   ///< share of the candidates that is kept at least, anywhere before the light
  bool by_rank;  ///< those first in the order are kept, not random ones
};
constexpr std::array kSpendings{
    Spending{"as built", Worth::block, 0.25f, true},
    Spending{"evenly before the light", Worth::even, 0.25f, true},
    Spending{"by light, at least 1/16", Worth::light, 1.0f / 16, true},
    Spending{"by light, at least 1/8", Worth::light, 1.0f / 8, true},
    Spending{"by light, at least 1/16, random", Worth::light, 1.0f / 16, false},
    Spending{"by texels, at least 1/16", Worth::texels, 1.0f / 16, true},
    Spending{"by texels, at least 1/8", Worth::texels, 1.0f / 8, true},
};

/// Draws maps of VPLs from a part of four times as many points, with discs that are as large as the points that were kept
/// are sparse.
class AdaptiveMaps {
 public:
  AdaptiveMaps(const BenchScene& bench, std::uint32_t points)
      : lights_(bench.lights),
        wanted_(points),
        points_{{bench.cpu_scene->view(), {points, 0.51f * kOverlap}},
                {bench.cpu_scene->view(), {points, 0.75f * kOverlap}},
                {bench.cpu_scene->view(), {points, 1.01f * kOverlap}},
                {bench.cpu_scene->view(), {points, 2 * kOverlap}}} {}

  /// A map as drawn; `used` receives the number of points.
  std::vector<std::uint16_t> draw(std::uint32_t light, const Spending& spending, double& used) const {
    const Vpl& vpl = lights_.vpls[light];
    const MapView view = vpl_map_view(vpl.position, vpl.axis, points_[0].bounds());
    const std::size_t all = points_[0].size(), candidates = std::min(all, std::size_t{4} * wanted_);
    const std::size_t start = block_start(map_stream(light, 0, map_seed(1)), static_cast<std::uint32_t>(all));
    std::vector<float> worth(candidates);
    for (std::size_t k = 0; k < candidates; ++k) worth[k] = worth_of(view, (start + k) % all, spending.worth);
    const double scale = find_scale(worth, spending.least);
    Chosen chosen;
    for (std::size_t k = 0; k < candidates; ++k) {
      const float share = share_of(worth[k], scale, spending.least);
      const float at = spending.by_rank ? (static_cast<float>(k) + 0.5f) / static_cast<float>(candidates)
                                        : random_of(light, static_cast<std::uint32_t>(k));
      if (at < share) chosen.add(points_, (start + k) % all, kOverlap * radius() * std::sqrt(0.25f / share));
    }
    used += static_cast<double>(chosen.count);
    return encode(chosen, view);
  }

  [[nodiscard]] MapView view_of(std::uint32_t light) const {
    return vpl_map_view(lights_.vpls[light].position, lights_.vpls[light].axis, points_[0].bounds());
  }

 private:
  static constexpr float kOverlap = PointOptions{}.overlap;
  static constexpr std::size_t kShapes = 4;

  /// The points of one map.
  struct Chosen {
    std::vector<float> columns[8];
    std::vector<std::uint32_t> shape;
    std::vector<DiscShape> shapes{DiscShape{}, DiscShape{}};
    std::size_t count = 0;

    /// @param radius  of a whole disc [m]
    void add(const SurfacePoints (&points)[kShapes], std::size_t i, float radius) {
      std::size_t fits = 0;
      while (fits + 1 < kShapes && radius > points[fits].arrays().shapes[0].radius) ++fits;
      const SurfacePoints& from = points[fits];
      const PointArrays& a = from.arrays();
      const Vec3 p = from.position(i), n = from.normal(i);
      const float row[8] = {p.x, p.y, p.z, n.x, n.y, n.z, a.sink_in_front[i], a.sink_behind[i]};
      for (std::size_t c = 0; c < 8; ++c) columns[c].push_back(row[c]);
      shape.push_back(static_cast<std::uint32_t>(shapes.size()));
      shapes.push_back(a.shapes[a.shape[i]]);
      shapes.back().radius = min_of(shapes.back().radius, radius);
      ++count;
    }
  };

  [[nodiscard]] float radius() const { return points_[0].arrays().shapes[0].radius / (0.51f * kOverlap); }
  [[nodiscard]] float worth_of(const MapView& view, std::size_t i, Worth worth) const {
    if (worth == Worth::block) return 1;
    const Vec3 local = to_local_point(view, points_[0].position(i));
    const float distance_sq = max_of(length_sq(local), radius() * radius());
    if (!(local.z > 0)) return 0;
    if (worth == Worth::even) return 1;
    const float inverse = 1 / std::sqrt(distance_sq), cosine = local.z * inverse;
    const Vec3 normal = to_local_vector(view.frame, points_[0].normal(i));
    const float solid = std::abs(dot(local, normal)) * inverse / distance_sq;
    return worth == Worth::light ? cosine * solid : solid / ((1 + cosine) * (1 + cosine));
  }
  static float share_of(float worth, double scale, float least) {
    return worth > 0 ? clamp_to(static_cast<float>(worth * scale), least, 1.0f) : 0.0f;
  }
  /// By which worths are multiplied so that as many points are kept as are wanted.
  [[nodiscard]] double find_scale(const std::vector<float>& worth, float least) const {
    double lo = 1e-9, hi = 1e9;
    for (int step = 0; step < 60; ++step) {
      const double middle = std::sqrt(lo * hi);
      double kept = 0;
      for (const float w : worth) kept += double{share_of(w, middle, least)};
      (kept < wanted_ ? lo : hi) = middle;
    }
    return lo;
  }
  static float random_of(std::uint32_t light, std::uint32_t k) {
    return static_cast<float>(combine_bits(light, k) >> 8) * 0x1p-24f;
  }
  [[nodiscard]] std::vector<std::uint16_t> encode(Chosen& chosen, const MapView& view) const {
    chosen.shapes[0].radius = 0;
    for (const DiscShape& s : chosen.shapes) chosen.shapes[0].radius = max_of(chosen.shapes[0].radius, s.radius);
    for (auto& column : chosen.columns) column.resize(chosen.count + 16);
    chosen.shape.resize(chosen.count + 16);
    const auto& c = chosen.columns;
    const PointArrays arrays{c[0].data(), c[1].data(), c[2].data(), c[3].data(),         c[4].data(),
                             c[5].data(), c[6].data(), c[7].data(), chosen.shape.data(), chosen.shapes.data()};
    std::vector<float> room(nearness_floats(kSize) + 16, 0.0f);
    auto* nearness = room.data();
    while (reinterpret_cast<std::uintptr_t>(nearness) % 64 != 0) ++nearness;
    const IsmKernels& kernels = ism_kernels(selected_isa());
    kernels.draw(arrays, 0, chosen.count, view, kSize, nearness);
    std::vector<std::uint16_t> codes(kSize * kSize + 8);
    kernels.encode16(nearness, view, kSize, codes.data());
    return codes;
  }

  const LightSet& lights_;
  std::uint32_t wanted_;
  SurfacePoints points_[kShapes];  ///< the same, with shapes of discs of half the usual radius to twice of it
};

/// Texels in which nothing was drawn though a ray through their centre meets a surface, of those that do [%].
double holes(const RayTracer& tracer, const MapView& view, const std::vector<std::uint16_t>& codes) {
  int met = 0, empty = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const float u = texel_centre(x, kSize), v = texel_centre(y, kSize);
      if (u * u + v * v >= 0.98f) continue;
      const Ray ray{view.origin, 0, to_world(view.frame, unproject_paraboloid(u, v)), view.far};
      if (!tracer.intersect(ray).valid()) continue;
      ++met;
      empty += codes[static_cast<std::size_t>(y * kSize + x)] == kNoDepth<std::uint16_t> ? 1 : 0;
    }
  }
  return met == 0 ? 0 : 100.0 * empty / met;
}

void fill(std::vector<std::uint16_t>& codes) {
  FillScratch<std::uint16_t> scratch;
  fill_holes(codes.data(), kSize, ShadowMapOptions{}.levels, HoleFill::edges, scratch);
}

struct Quality {
  oracle::Tally pairs;
  double holes = 0, points = 0;
};

Quality measure(const BenchScene& bench, const AdaptiveMaps& maps, const Spending& spending) {
  constexpr std::size_t step = 20;
  Quality result;
  oracle::ReceiverSampler sampler(bench.cpu_scene->view(), 1);
  double lights = 0;
  for (std::size_t light = 0; light < bench.lights.vpls.size(); light += step, ++lights) {
    const auto id = static_cast<std::uint32_t>(light);
    const Vpl& vpl = bench.lights.vpls[light];
    const Vec3 target = offset_point(vpl.position, vpl.axis);
    const MapView view = maps.view_of(id);
    std::vector<std::uint16_t> codes = maps.draw(id, spending, result.points);
    result.holes += holes(*bench.tracer, view, codes);
    fill(codes);
    const auto fetch = [&](int x, int y) { return codes[static_cast<std::size_t>(y * kSize + x)]; };
    for (int found = 0, tries = 0; found < 160 && tries < 20000; ++tries) {
      const auto p = sampler.draw();
      const Vec3 to_light = target - p.position;
      if (dot(to_light, vpl.axis) >= 0 || dot(to_light, p.normal) <= 0) continue;
      ++found;
      result.pairs.add(!bench.tracer->occluded(shadow_ray(p.position, target)),
                       lookup_visibility<std::uint16_t>(view, to_local_point(view, p.position),
                                                        to_local_vector(view.frame, p.normal), kSize, fetch));
    }
  }
  result.holes /= lights;
  result.points /= lights;
  return result;
}

}  // namespace

void print_adaptive_heading() {
  fmt::print(
      "| scene | points | spent | used | holes % | agreement % | balanced % | wrongly lit % | wrongly dark % | relmse "
      "/ "
      "FLIP |\n|---|---|---|---|---|---|---|---|---|---|\n");
}

void compare_adaptive_points(const BenchScene& bench, std::uint32_t points) {
  const oracle::LookupRule as_built{"as built", oracle::TapWeights::linear, kBiasTexels, kBesideBiasTexels};
  const AdaptiveMaps adaptive(bench, points);
  const SurfacePoints usual_points(bench.cpu_scene->view(), {points});
  ShadowMapSet usual(ism_kernels(selected_isa()), usual_points, bench.lights, {});
  usual.add(every_light(bench.lights));
  const Pictures pictures(bench);
  for (const Spending& spending : kSpendings) {
    const Quality q = measure(bench, adaptive, spending);
    CodesVisibility visibility(as_built, usual);
    double used = 0;
    for (std::uint32_t light = 0; light < bench.lights.vpls.size(); ++light) {
      std::vector<std::uint16_t> codes = adaptive.draw(light, spending, used);
      fill(codes);
      visibility.add({codes.begin(), codes.end()});
    }
    const Comparison c = pictures.compare_to_rays(visibility);
    const oracle::Tally& p = q.pairs;
    fmt::print("| {} | {} | {} | {:.0f} | {:.2f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.3g} / {:.4f} |\n", bench.name,
               points, spending.name, q.points, q.holes, 100 * p.agreement(), 100 * p.balanced(),
               100 * p.wrongly_lit / p.pairs(), 100 * p.wrongly_dark / p.pairs(), c.relmse, c.flip);
    std::fflush(stdout);
  }
}

}  // namespace lightcuts
