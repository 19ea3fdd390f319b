#include "cpu/vpl_tracer.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

#include "backend/vpl_placement.h"
#include "backend/vpl_plan.h"
#include "cpu/vpl_placement.h"
#include "kernels/light_path.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

constexpr std::uint64_t kChunk = 512;  ///< paths that one task traces, one after the other

constexpr double kTracingShare = 0.1;  ///< of the time, where candidates are rated afterwards

/// Progress from `begin` to `end` of the stage's.
ProgressFn part_of(const ProgressFn& progress, double begin, double end) {
  if (!progress) return {};
  return
      [&progress, begin, end](const char* stage, double done) { return progress(stage, begin + done * (end - begin)); };
}

/// Everything that the helpers below share.
struct Tracing {
  const SceneView& scene;
  const EmitterTable& table;
  const EmitterView& emitters;
  const RayTracer& tracer;
  const VplOptions& options;
  LightPathOptions path;

  [[nodiscard]] SampleStream stream(std::uint64_t seed, std::uint64_t index) const {
    return {seed, static_cast<std::uint32_t>(index), options.sequence == Sequence::sobol};
  }
  [[nodiscard]] double area_power() const { return table.power(0, emitters.triangle_count); }
  [[nodiscard]] double punctual_power() const { return table.power(emitters.triangle_count, emitters.punctual_end()); }
  [[nodiscard]] double sky_power() const { return table.power(emitters.punctual_end(), emitters.entry_count()); }
};

PrimarySample draw_primary(const Tracing& t, VplPurpose purpose, std::uint64_t index, std::uint32_t first,
                           std::uint32_t last) {
  return lightcuts::draw_primary(t.emitters, t.stream(derive_seed(t.options.seed, purpose), index), first, last);
}

/// Samples of all kinds: those on area lights and of the sky are lights of the sum, too.
std::vector<PrimarySample> draw_primaries(const Tracing& t, const VplShares& shares) {
  std::vector<PrimarySample> primaries;
  const EmitterView& e = t.emitters;
  primaries.reserve(shares.total());
  for (std::uint64_t i = 0; i < shares.area; ++i) {
    primaries.push_back(draw_primary(t, area_samples, i, 0, e.triangle_count));
  }
  for (std::uint64_t i = 0; i < shares.punctual; ++i) {
    primaries.push_back(draw_primary(t, punctual_samples, i, e.triangle_count, e.punctual_end()));
  }
  for (std::uint64_t i = 0; i < shares.sky; ++i) {
    primaries.push_back(draw_primary(t, sky_samples, i, e.punctual_end(), e.entry_count()));
  }
  return primaries;
}

void add_primary_lights(const Tracing& t, const VplShares& shares, const std::vector<PrimarySample>& primaries,
                        Lights& lights) {
  for (std::uint64_t i = 0; i < shares.area; ++i) {
    const PrimarySample& p = primaries[i];
    const AreaSample s = sample_area(t.scene, t.emitters, p.entry, p.start, p.side);
    const Vec3 intensity = s.intensity * static_cast<float>(1 / (p.probability * static_cast<double>(shares.area)));
    if (carries_light(intensity)) lights.vpls.push_back({s.position, s.axis, intensity});  // (3.4)
  }
  lights.primary_count = lights.vpls.size();
  for (std::uint64_t i = shares.area + shares.punctual; i < primaries.size(); ++i) {
    const EnvironmentSample sky =
        sample_environment(t.emitters.environment, primaries[i].start.x, primaries[i].start.y);
    const Vec3 irradiance = sky.radiance / (sky.pdf * static_cast<float>(shares.sky));
    if (carries_light(irradiance)) lights.directionals.push_back({-sky.direction, irradiance});
  }
  lights.sky_count = lights.directionals.size();
}

void add_punctual_lights(const Scene& scene, Lights& lights) {
  for (const PointLight& p : scene.point_lights) {
    if (carries_light(p.intensity)) lights.points.push_back(p);
  }
  for (const DirectionalLight& d : scene.directional_lights) {
    if (carries_light(d.irradiance)) lights.directionals.push_back(d);
  }
}

/// Runs `trace(path, sink)` for every path in parallel and returns all VPLs in the order of the paths.
/// Returns false where progress asked to stop.
template <class Trace>
bool collect_paths(std::uint64_t paths, const ProgressFn& progress, Trace trace, std::vector<Vpl>& out) {
  const std::uint64_t chunks = (paths + kChunk - 1) / kChunk;
  std::vector<std::vector<Vpl>> found(chunks);
  std::atomic<std::uint64_t> done{0};
  std::atomic<bool> stop{false};
  std::mutex reporting;
  tbb::parallel_for(std::uint64_t{0}, chunks, [&](std::uint64_t c) {
    if (stop) return;
    for (std::uint64_t i = c * kChunk; i < std::min(paths, (c + 1) * kChunk); ++i) {
      trace(i, [&](const Vpl& vpl) {
        if (carries_light(vpl.intensity)) found[c].push_back(vpl);
      });
    }
    const std::uint64_t now = ++done;
    if (progress) {
      const std::lock_guard<std::mutex> one_at_a_time(reporting);
      if (!stop && !progress("vpls", static_cast<double>(now) / static_cast<double>(chunks))) stop = true;
    }
  });
  if (stop) return false;
  std::size_t total = out.size();
  for (const auto& f : found) total += f.size();
  out.reserve(total);
  for (auto& f : found) {
    out.insert(out.end(), f.begin(), f.end());
    std::vector<Vpl>().swap(f);
  }
  return true;
}

VplPilot fly_pilot(const Tracing& t, std::uint64_t wanted) {
  const std::uint64_t paths = pilot_path_count(wanted);
  const std::uint64_t seed = derive_seed(t.options.seed, pilot_paths);
  std::vector<int> counts(paths, 0);
  tbb::parallel_for(tbb::blocked_range<std::uint64_t>(0, paths, kChunk), [&](const auto& range) {
    for (std::uint64_t i = range.begin(); i != range.end(); ++i) {
      trace_light_path_of_stream(t.scene, t.emitters, t.tracer, t.stream(seed, i), 1.0f, t.path,
                                 [&](const Vpl& vpl) { counts[i] += carries_light(vpl.intensity) ? 1 : 0; });
    }
  });
  double sum = 0, sum_sq = 0;
  for (const int c : counts) sum += c, sum_sq += static_cast<double>(c) * c;
  return make_pilot(paths, sum, sum_sq);
}

/// Keeps `wanted` of the VPLs behind `first`, evenly along the order of paths from a random start, and makes up for the
/// others: each stays with the same probability, so given the paths the expected sum is the same.
void thin_out(std::uint64_t first, std::uint64_t wanted, std::uint64_t seed, std::vector<Vpl>& vpls) {
  const std::uint64_t made = vpls.size() - first;
  const double step = static_cast<double>(wanted) / static_cast<double>(made);
  const double start = philox(0, 0, 0, derive_seed(seed, vpl_thinning)).unit_double(0);
  std::uint64_t kept = first;
  for (std::uint64_t j = 0; j < made; ++j) {
    const double before = start + step * static_cast<double>(j), after = start + step * static_cast<double>(j + 1);
    if (std::floor(after) > std::floor(before)) vpls[kept++] = vpls[first + j];
  }
  vpls.resize(kept);
  for (std::uint64_t j = first; j < kept; ++j) vpls[j].intensity *= static_cast<float>(1 / step);
}

bool trace_counted(const Tracing& t, std::uint64_t n, const ProgressFn& progress, Lights& lights) {
  const bool samples = t.area_power() + t.sky_power() > 0;
  const std::uint64_t primary = !samples ? 0 : t.options.bounces == 0 ? n : std::max<std::uint64_t>(1, (n + 2) / 4);
  const VplShares shares = share_by_power(primary, t.area_power(), 0, t.sky_power());
  add_primary_lights(t, shares, draw_primaries(t, shares), lights);
  if (t.options.bounces == 0) return true;
  const std::uint64_t wanted = std::max<std::uint64_t>(1, n - std::min(n, shares.total()));
  const std::uint64_t first = lights.vpls.size();
  lights.path_count = paths_for(wanted, fly_pilot(t, wanted));
  const auto scale = static_cast<float>(1.0 / static_cast<double>(lights.path_count));
  const bool complete = collect_paths(
      lights.path_count, progress,
      [&](std::uint64_t i, auto&& sink) {
        trace_light_path_of_stream(t.scene, t.emitters, t.tracer, t.stream(t.options.seed, i), scale, t.path, sink);
      },
      lights.vpls);
  const std::uint64_t made = lights.vpls.size() - first;
  if (needs_thinning(made, wanted)) thin_out(first, wanted, t.options.seed, lights.vpls);
  return complete;
}

bool trace_study_layout(const Tracing& t, const ProgressFn& progress, Lights& lights) {
  const std::uint64_t k = t.options.vpls_per_light;
  const VplShares shares = share_by_power(t.options.primary_lights, t.area_power(), t.punctual_power(), t.sky_power());
  const std::vector<PrimarySample> primaries = draw_primaries(t, shares);
  add_primary_lights(t, shares, primaries, lights);
  if (t.options.bounces == 0) return true;
  lights.path_count = shares.total() * k;
  return collect_paths(
      lights.path_count, progress,
      [&](std::uint64_t i, auto&& sink) {
        const PrimarySample& p = primaries[i / k];
        const bool area = p.entry < t.emitters.triangle_count, sky = p.entry >= t.emitters.punctual_end();
        const std::uint64_t of_kind = area ? shares.area : sky ? shares.sky : shares.punctual;
        const auto scale = static_cast<float>(1.0 / (static_cast<double>(of_kind) * static_cast<double>(k)));
        trace_light_path_of_primary(t.scene, t.emitters, t.tracer, p, t.stream(t.options.seed, i), scale, t.path, sink);
      },
      lights.vpls);
}

}  // namespace

Lights trace_vpls(const SceneArrays& scene, const EmitterTable& emitters, const RayTracer& tracer,
                  const VplOptions& options, const ProgressFn& progress) {
  check_vpl_options(options);
  if (!(emitters.total_power() > 0)) {
    throw Error(Code::no_emitter, "nothing in the scene emits light: add a light or an environment");
  }
  Tracing t{scene.view(), emitters, emitters.view(), tracer, options, {}};
  const bool for_camera = options.placement == VplPlacement::camera;
  t.path.bounces = std::min(options.bounces, kMaxBounces);
  if (options.deposit == Deposit::study) t.path.study_distance_sq = options.deposit_distance * options.deposit_distance;
  Lights lights;
  const std::uint64_t wanted = for_camera ? placement_candidates(options.count) : options.count;
  const bool complete =
      options.primary_lights > 0
          ? trace_study_layout(t, progress, lights)
          : trace_counted(t, wanted, for_camera ? part_of(progress, 0, kTracingShare) : progress, lights);
  if (!complete) return {};
  add_punctual_lights(scene.scene(), lights);
  if (for_camera && !place_for_camera(t.scene, tracer, options, part_of(progress, kTracingShare, 1), lights)) return {};
  return lights;
}

Lights trace_vpls(const SceneArrays& scene, const RayTracer& tracer, const VplOptions& options,
                  const ProgressFn& progress) {
  const EmitterTable emitters(scene);
  return trace_vpls(scene, emitters, tracer, options, progress);
}

}  // namespace lightcuts
