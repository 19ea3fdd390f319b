// What other biases of a lookup would give.

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <array>
#include <vector>

#include "cpu/simd/isa.h"
#include "measurements.h"
#include "oracle/contact_shadows.h"
#include "oracle/lit_surfaces.h"
#include "oracle/lookup_rules.h"
#include "oracle/tally.h"
#include "pictures.h"

namespace lightcuts {
namespace {

using Code = std::uint16_t;

using oracle::TapWeights;
constexpr std::array kRules{
    oracle::LookupRule{"as built: linear, beside 1 where lit", TapWeights::linear, 0.25f, 1},
    oracle::LookupRule{"linear", TapWeights::linear},
    oracle::LookupRule{"two texels: beside 1 where lit", TapWeights::two, 0.25f, 1},
    oracle::LookupRule{"two texels: 1/4", TapWeights::two},
    oracle::LookupRule{"middle alone, 1/2", TapWeights::middle, 0.5f},
    oracle::LookupRule{"linear, 1/2", TapWeights::linear, 0.5f, 0.5f, 0.5f},
    oracle::LookupRule{"linear, beside 2 where lit, -1/2 where dark", TapWeights::linear, 0.25f, 2, -0.5f},
    oracle::LookupRule{"middle alone", TapWeights::middle},
    oracle::LookupRule{"middle alone, 1", TapWeights::middle, 1},
    oracle::LookupRule{"even"},
    oracle::LookupRule{"even, all 1", TapWeights::even, 1, 1, 1},
    oracle::LookupRule{"even, outer 3/4", TapWeights::even, 0.25f, 0.75f, 0.75f},
    oracle::LookupRule{"even, outer 1", TapWeights::even, 0.25f, 1, 1},
    oracle::LookupRule{"even, outer 3/4 where lit", TapWeights::even, 0.25f, 0.75f},
    oracle::LookupRule{"even, outer 1 where lit", TapWeights::even, 0.25f, 1},
    oracle::LookupRule{"even, outer 2 where lit", TapWeights::even, 0.25f, 2},
    oracle::LookupRule{"even, outer 2 where lit, -1/2 where dark", TapWeights::even, 0.25f, 2, -0.5f},
    oracle::LookupRule{"even, outer 1/4 above the plane", TapWeights::even, 0.25f, 0.25f, 0.25f, true},
    oracle::LookupRule{"even, outer 1 above the plane where lit", TapWeights::even, 0.25f, 1, 0.25f, true},
    oracle::LookupRule{"half for the middle", TapWeights::heavy},
};

/// One light's depths: those of its map, and exact ones, traced when they are first asked for.
class LightDepths {
 public:
  LightDepths(const ShadowMapSet& maps, const RayTracer& tracer, std::uint32_t light)
      : tracer_(tracer),
        view_(maps.view_of(LightKind::vpl, light)),
        size_(maps.maker().options().size),
        codes_(maps.codes_of(LightKind::vpl, light)),
        exact_(codes_.size(), kUnknown) {}

  [[nodiscard]] const MapView& view() const { return view_; }
  float share(const oracle::LookupRule& rule, Vec3 at, Vec3 normal) const {
    const auto fetch = [&](int x, int y) { return static_cast<Code>(codes_[index(x, y)]); };
    return oracle::look_up_by<Code>(rule, view_, to_local_point(view_, at), to_local_vector(view_.frame, normal), size_,
                                    fetch);
  }
  float exact_share(const oracle::LookupRule& rule, Vec3 at, Vec3 normal) {
    const auto fetch = [&](int x, int y) { return traced(x, y); };
    return oracle::look_up_by<Code>(rule, view_, to_local_point(view_, at), to_local_vector(view_.frame, normal), size_,
                                    fetch);
  }

 private:
  static constexpr std::uint32_t kUnknown = 1u << 16;

  [[nodiscard]] std::size_t index(int x, int y) const { return static_cast<std::size_t>(y * size_ + x); }
  Code traced(int x, int y) {
    std::uint32_t& code = exact_[index(x, y)];
    if (code == kUnknown) {
      const float u = texel_centre(x, size_), v = texel_centre(y, size_);
      const Hit hit =
          tracer_.intersect({view_.origin, 0, to_world(view_.frame, unproject_paraboloid(u, v)), view_.far});
      const bool inside = u * u + v * v < view_.rim_sq;
      code = inside && hit.valid() ? encode_depth<Code>(hit.t, kDepthSteps<Code> / view_.far) : kNoDepth<Code>;
    }
    return static_cast<Code>(code);
  }

  const RayTracer& tracer_;
  MapView view_;
  int size_;
  std::vector<std::uint32_t> codes_, exact_;
};

bool faces(const Vpl& vpl, Vec3 target, const oracle::ReceiverSampler::Point& p, float least) {
  const Vec3 to_light = target - p.position;
  const float distance = length(to_light);
  return dot(to_light, vpl.axis) < -least * distance && dot(to_light, p.normal) > least * distance;
}

/// Visibility of VPLs by another rule, of the other lights as built.
CodesVisibility by_rule(const oracle::LookupRule& rule, const ShadowMapSet& maps) {
  CodesVisibility visibility(rule, maps);
  for (std::uint32_t i = 0; i < maps.maker().lights().vpls.size(); ++i) {
    visibility.add(maps.codes_of(LightKind::vpl, i));
  }
  return visibility;
}

}  // namespace

void print_rules_heading() {
  fmt::print(
      "| scene | texels | rule | lit % | agreement % | balanced % | wrongly lit % | wrongly dark % "
      "|\n|---|---|---|---|---|---|---|---|\n");
}

void compare_lookup_rules(const BenchScene& bench, int size) {
  constexpr std::size_t step = 20;
  const SurfacePoints points(bench.cpu_scene->view(), {8000});
  ShadowMapOptions options;
  options.size = size;
  ShadowMapSet maps(ism_kernels(selected_isa()), points, bench.lights, options);
  maps.add(every_light(bench.lights, 0, step));
  std::array<oracle::Tally, kRules.size()> pairs{}, exact_pairs{}, lit{}, exact_lit{};
  oracle::ReceiverSampler sampler(bench.cpu_scene->view(), 1);
  for (std::size_t light = 0; light < bench.lights.vpls.size(); light += step) {
    const Vpl& vpl = bench.lights.vpls[light];
    const Vec3 target = offset_point(vpl.position, vpl.axis);
    LightDepths depths(maps, *bench.tracer, static_cast<std::uint32_t>(light));
    int found = 0, clear = 0;
    for (int tries = 0; tries < 20000 && (found < 160 || (clear < 40 && tries < 3000)); ++tries) {
      const auto p = sampler.draw();
      if (!faces(vpl, target, p, 0)) continue;
      const bool visible = !bench.tracer->occluded(shadow_ray(p.position, target));
      if (found++ < 160) {
        for (std::size_t r = 0; r < kRules.size(); ++r) {
          pairs[r].add(visible, depths.share(kRules[r], p.position, p.normal));
          exact_pairs[r].add(visible, depths.exact_share(kRules[r], p.position, p.normal));
        }
      }
      if (clear >= 40 || !visible || !faces(vpl, target, p, 0.05f) ||
          oracle::around(*bench.tracer, depths.view(), size, p.position, p.normal) == oracle::Around::shadow) {
        continue;
      }
      ++clear;
      for (std::size_t r = 0; r < kRules.size(); ++r) {
        lit[r].add(true, depths.share(kRules[r], p.position, p.normal));
        exact_lit[r].add(true, depths.exact_share(kRules[r], p.position, p.normal));
      }
    }
  }
  for (std::size_t r = 0; r < kRules.size(); ++r) {
    const oracle::Tally& p = pairs[r];
    const oracle::Tally& e = exact_pairs[r];
    fmt::print(
        "| {} | {} | {} | {:.2f} ({:.2f}) | {:.1f} ({:.1f}) | {:.1f} ({:.1f}) | {:.1f} ({:.1f}) | {:.1f} ({:.1f}) |\n",
        bench.name, size, kRules[r].name, 100 * lit[r].kept(), 100 * exact_lit[r].kept(), 100 * p.agreement(),
        100 * e.agreement(), 100 * p.balanced(), 100 * e.balanced(), 100 * p.wrongly_lit / p.pairs(),
        100 * e.wrongly_lit / e.pairs(), 100 * p.wrongly_dark / p.pairs(), 100 * e.wrongly_dark / e.pairs());
  }
  std::fflush(stdout);
}

void print_rule_pictures_heading() {
  fmt::print("| scene | texels | rule | relmse / FLIP | signed error |\n|---|---|---|---|---|\n");
}

void compare_pictures_by_rules(const BenchScene& bench, int size) {
  const Pictures pictures(bench);
  const SurfacePoints points(bench.cpu_scene->view(), {8000});
  ShadowMapOptions options;
  options.size = size;
  ShadowMapSet maps(ism_kernels(selected_isa()), points, bench.lights, options);
  maps.add(every_light(bench.lights));
  for (const oracle::LookupRule& rule : kRules) {
    const Comparison c = pictures.compare_to_rays(by_rule(rule, maps));
    fmt::print("| {} | {} | {} | {:.3g} / {:.4f} | {:+.1f} % |\n", bench.name, size, rule.name, c.relmse, c.flip,
               100 * c.signed_relative_error);
    std::fflush(stdout);
  }
}

void print_contact_heading() {
  fmt::print(
      "| texels | rule | floor, 1 cm: leaked / kept % | 2 cm | 5 cm | 10 cm | box, 1 cm: kept % | 2 cm | 5 cm | 10 cm "
      "|\n|---|---|---|---|---|---|---|---|---|---|\n");
}

void measure_contact_shadows(int size) {
  constexpr std::size_t step = 10;
  const BenchScene bench("a box on a floor", oracle::box_on_floor(), 2000);
  const SurfacePoints points(bench.cpu_scene->view(), {8000});
  ShadowMapOptions options;
  options.size = size;
  ShadowMapSet maps(ism_kernels(selected_isa()), points, bench.lights, options);
  maps.add(every_light(bench.lights, 0, step));
  std::vector<LightDepths> depths;
  for (std::size_t light = 0; light < bench.lights.vpls.size(); light += step) {
    depths.emplace_back(maps, *bench.tracer, static_cast<std::uint32_t>(light));
  }
  constexpr std::array off{0.01f, 0.02f, 0.05f, 0.1f};
  std::array<std::array<oracle::Tally, off.size()>, kRules.size()> floor{}, box{};
  for (const oracle::ContactSide side : {oracle::ContactSide::floor, oracle::ContactSide::box}) {
    auto& found = side == oracle::ContactSide::floor ? floor : box;
    for (std::size_t d = 0; d < off.size(); ++d) {
      oracle::for_each_contact(bench.lights, *bench.tracer, step, off[d], side,
                               [&](std::uint32_t light, Vec3 at, Vec3 normal, bool visible) {
                                 for (std::size_t r = 0; r < kRules.size(); ++r) {
                                   found[r][d].add(visible, depths[light / step].share(kRules[r], at, normal));
                                 }
                               });
    }
  }
  for (std::size_t r = 0; r < kRules.size(); ++r) {
    fmt::print("| {} | {} |", size, kRules[r].name);
    for (const oracle::Tally& t : floor[r]) fmt::print(" {:.1f} / {:.1f} |", 100 * t.leaked(), 100 * t.kept());
    for (const oracle::Tally& t : box[r]) fmt::print(" {:.1f} |", 100 * t.kept());
    fmt::print("\n");
  }
  std::fflush(stdout);
}

}  // namespace lightcuts
