// What other biases of a lookup would give.

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <array>
#include <random>
#include <vector>

#include "backend/emitter_table.h"
#include "bench_scene.h"
#include "cpu/all_lights.h"
#include "cpu/film.h"
#include "cpu/progress.h"
#include "cpu/shade_picture.h"
#include "cpu/simd/isa.h"
#include "cpu_core/scene_parts.h"
#include "lightcuts/compare.h"
#include "oracle/lit_surfaces.h"
#include "oracle/lookup_rules.h"

namespace lightcuts {
namespace {

using Code = std::uint16_t;

using oracle::TapWeights;
constexpr std::array kRules{
    oracle::LookupRule{"as built"},
    oracle::LookupRule{"outer 1 where lit", TapWeights::even, 0.25f, 1},
    oracle::LookupRule{"outer 2 where lit, -1/2 where dark", TapWeights::even, 0.25f, 2, -0.5f},
    oracle::LookupRule{"middle 1/2", TapWeights::heavy},
    oracle::LookupRule{"linear", TapWeights::linear},
    oracle::LookupRule{"linear, 1/2", TapWeights::linear, 0.5f, 0.5f, 0.5f},
    oracle::LookupRule{"linear, 1 where lit", TapWeights::linear, 0.25f, 1},
    oracle::LookupRule{"linear, 2 where lit, -1/2 where dark", TapWeights::linear, 0.25f, 2, -0.5f},
    oracle::LookupRule{"middle alone, 0", TapWeights::middle, 0},
    oracle::LookupRule{"middle alone", TapWeights::middle},
    oracle::LookupRule{"middle alone, 1/2", TapWeights::middle, 0.5f},
    oracle::LookupRule{"middle alone, 1", TapWeights::middle, 1},
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

/// What a rule says of places that rays call lit or dark.
struct Tally {
  double lit = 0, dark = 0, wrongly_lit = 0, wrongly_dark = 0;  ///< pairs
  double lit_share = 0, dark_share = 0;                         ///< sums

  void add(bool visible, float share) {
    (visible ? lit : dark) += 1;
    (visible ? lit_share : dark_share) += share;
    wrongly_lit += !visible && share > 0.5f ? 1 : 0;
    wrongly_dark += visible && !(share > 0.5f) ? 1 : 0;
  }
  [[nodiscard]] double pairs() const { return lit + dark; }
  [[nodiscard]] double agreement() const { return 1 - (wrongly_lit + wrongly_dark) / pairs(); }
  [[nodiscard]] double balanced() const { return 1 - 0.5 * (wrongly_lit / dark + wrongly_dark / lit); }
};

bool faces(const Vpl& vpl, Vec3 target, const oracle::ReceiverSampler::Point& p, float least) {
  const Vec3 to_light = target - p.position;
  const float distance = length(to_light);
  return dot(to_light, vpl.axis) < -least * distance && dot(to_light, p.normal) > least * distance;
}

/// Visibility of VPLs by another rule, of the other lights as built.
class RuleVisibility final : public PacketVisibility {
 public:
  RuleVisibility(const oracle::LookupRule& rule, const ShadowMapSet& maps, const LightSet& lights)
      : rule_(rule), maps_(maps) {
    for (std::uint32_t i = 0; i < lights.vpls.size(); ++i) {
      views_.push_back(maps.view_of(LightKind::vpl, i));
      codes_.push_back(maps.codes_of(LightKind::vpl, i));
    }
  }
  std::uint32_t shares(const VisibilityQuery& query, float* share) const override {
    if (query.kind != LightKind::vpl) {
      maps_.shares(query.kind, query.light, query.receivers, query.candidates, share);
      return 0;
    }
    const MapView& view = views_[query.light];
    const std::uint32_t* codes = codes_[query.light].data();
    const int size = maps_.maker().options().size;
    const auto fetch = [&](int x, int y) { return static_cast<Code>(codes[y * size + x]); };
    const ReceiverPacket& r = query.receivers;
    for (int lane = 0; lane < kPacketSize; ++lane) {
      share[lane] = 0;
      if ((query.candidates >> lane & 1u) == 0) continue;
      const Vec3 at{r.position.x[lane], r.position.y[lane], r.position.z[lane]};
      const Vec3 ng{r.ng.x[lane], r.ng.y[lane], r.ng.z[lane]};
      share[lane] =
          oracle::look_up_by<Code>(rule_, view, to_local_point(view, at), to_local_vector(view.frame, ng), size, fetch);
    }
    return 0;
  }

 private:
  const oracle::LookupRule& rule_;
  const ShadowMapSet& maps_;
  std::vector<MapView> views_;
  std::vector<std::vector<std::uint32_t>> codes_;
};

/// Asks at places around a box for which no ray is in doubt: near its foot on the floor, and near the floor on its sides.
struct BoxOnFloor {
  static constexpr float kHalf = 0.3f;

  oracle::ReceiverSampler::Point draw(std::mt19937& dice, float off, bool on_floor) const {
    std::uniform_real_distribution<float> along(-0.9f * kHalf, 0.9f * kHalf);
    const int side = static_cast<int>(dice() % 4);
    const Vec3 out = side == 0   ? Vec3{1, 0, 0}
                     : side == 1 ? Vec3{-1, 0, 0}
                     : side == 2 ? Vec3{0, 0, 1}
                                 : Vec3{0, 0, -1};
    const Vec3 across{out.z, 0, out.x};
    const Vec3 foot = out * kHalf + across * along(dice);
    if (on_floor) return {foot + out * off + Vec3{0, 1e-4f, 0}, {0, 1, 0}};
    return {foot + out * 1e-4f + Vec3{0, off, 0}, out};
  }
};

Scene box_on_floor() {
  Scene scene;
  const auto grey = test::add_material(scene, {0.6f, 0.6f, 0.6f});
  const auto lamp = test::add_material(scene, {0, 0, 0}, {10, 10, 10});
  test::place(scene, test::box({-2, 0, -2}, {2, 2.8f, 2}, grey, true));
  const float h = BoxOnFloor::kHalf;
  test::place(scene, test::box({-h, 0, -h}, {h, 2 * h, h}, grey));
  test::place(scene, test::quad({-0.4f, 2.79f, -0.4f}, {0.8f, 0, 0}, {0, 0, 0.8f}, lamp));
  return scene;
}

}  // namespace

void compare_lookup_rules(const BenchScene& bench, int size) {
  constexpr std::size_t step = 20;
  const SurfacePoints points(bench.cpu_scene->view(), {8000});
  ShadowMapOptions options;
  options.size = size;
  ShadowMapSet maps(ism_kernels(selected_isa()), points, bench.lights, options);
  maps.add(every_light(bench.lights, 0, step));
  std::array<Tally, kRules.size()> pairs{}, exact_pairs{}, lit{}, exact_lit{};
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
          oracle::at_shadow_edge(*bench.tracer, depths.view(), size, p.position, p.normal, true)) {
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
    const Tally& p = pairs[r];
    const Tally& e = exact_pairs[r];
    fmt::print(
        "| {} | {} | {} | {:.2f} ({:.2f}) | {:.1f} ({:.1f}) | {:.1f} ({:.1f}) | {:.1f} ({:.1f}) | {:.1f} ({:.1f}) |\n",
        bench.name, size, kRules[r].name, 100 * lit[r].lit_share / lit[r].lit,
        100 * exact_lit[r].lit_share / exact_lit[r].lit, 100 * p.agreement(), 100 * e.agreement(), 100 * p.balanced(),
        100 * e.balanced(), 100 * p.wrongly_lit / p.pairs(), 100 * e.wrongly_lit / e.pairs(),
        100 * p.wrongly_dark / p.pairs(), 100 * e.wrongly_dark / e.pairs());
  }
  std::fflush(stdout);
}

void compare_pictures_by_rules(const BenchScene& bench, int size) {
  constexpr int side = 128;
  const EmitterTable emitters(*bench.cpu_scene);
  const View view = make_view(select_camera(bench.scene, ""), side, side, 1, 1, true);
  const TileSource source{view, bench.cpu_scene->view(), *bench.tracer, emitters.view()};
  const float min_distance = 0.01f * bench.cpu_scene->view().diagonal;
  const auto render = [&](const PacketVisibility& visibility) {
    const ProgressFn none;
    Progress progress(none, "shade", 1);
    const AllLights lighter(shade_kernels(selected_isa()), bench.lights, &visibility, min_distance);
    Film film(side, side);
    for_each_tile(view, film, progress, lit_tile(source, lighter, progress));
    return film.image(1);
  };
  const Image reference = render(RayVisibility(*bench.tracer));
  const SurfacePoints points(bench.cpu_scene->view(), {8000});
  ShadowMapOptions options;
  options.size = size;
  ShadowMapSet maps(ism_kernels(selected_isa()), points, bench.lights, options);
  maps.add(every_light(bench.lights));
  for (const oracle::LookupRule& rule : kRules) {
    const Comparison c = compare(render(RuleVisibility(rule, maps, bench.lights)), reference);
    fmt::print("| {} | {} | {} | {:.3g} / {:.4f} | {:+.1f} % |\n", bench.name, size, rule.name, c.relmse, c.flip,
               100 * c.signed_relative_error);
    std::fflush(stdout);
  }
}

void contact_shadows(int size) {
  constexpr std::size_t step = 10;
  const BenchScene bench("a box on a floor", box_on_floor(), 2000);
  const SurfacePoints points(bench.cpu_scene->view(), {8000});
  ShadowMapOptions options;
  options.size = size;
  ShadowMapSet maps(ism_kernels(selected_isa()), points, bench.lights, options);
  maps.add(every_light(bench.lights, 0, step));
  constexpr std::array<float, 5> off{0.005f, 0.01f, 0.02f, 0.05f, 0.1f};
  std::array<std::array<Tally, off.size()>, kRules.size()> floor{}, side{};
  std::mt19937 dice(1);
  const BoxOnFloor box;
  for (std::size_t light = 0; light < bench.lights.vpls.size(); light += step) {
    const Vpl& vpl = bench.lights.vpls[light];
    const Vec3 target = offset_point(vpl.position, vpl.axis);
    const LightDepths depths(maps, *bench.tracer, static_cast<std::uint32_t>(light));
    for (std::size_t d = 0; d < off.size(); ++d) {
      for (int k = 0; k < 80; ++k) {
        const auto p = box.draw(dice, off[d], k % 2 == 0);
        if (!faces(vpl, target, p, 0)) continue;
        const bool visible = !bench.tracer->occluded(shadow_ray(p.position, target));
        for (std::size_t r = 0; r < kRules.size(); ++r) {
          (k % 2 == 0 ? floor : side)[r][d].add(visible, depths.share(kRules[r], p.position, p.normal));
        }
      }
    }
  }
  for (std::size_t r = 0; r < kRules.size(); ++r) {
    fmt::print("| {} | {} |", size, kRules[r].name);
    for (std::size_t d = 0; d < off.size(); ++d) {
      const Tally& t = floor[r][d];
      fmt::print(" {:.1f} / {:.1f} |", 100 * t.dark_share / t.dark, 100 * t.lit_share / t.lit);
    }
    for (std::size_t d = 0; d < off.size(); ++d) {
      const Tally& t = side[r][d];
      fmt::print(" {:.1f} |", 100 * t.lit_share / t.lit);
    }
    fmt::print("\n");
  }
  std::fflush(stdout);
}

}  // namespace lightcuts
