#include <algorithm>
#include <cmath>
#include <vector>

#include "backend/vpl_plan.h"
#include "cuda/executor.cuh"
#include "cuda/tracer.cuh"
#include "cuda/vpl_kernels.h"

namespace lightcuts::cuda {
namespace {

/// Numbers of a stream, as every kernel here draws them.
struct Streams {
  std::uint64_t seed;
  bool low_discrepancy;
  __device__ SampleStream operator[](std::uint32_t index) const { return {seed, index, low_discrepancy}; }
};

/// The three runs of primary samples, one behind the other: area lights, punctual lights, sky.
struct DrawPrimaries {
  EmitterView emitters;
  Streams area, punctual, sky;
  std::uint32_t area_count, punctual_count;
  PrimarySample* primaries;

  __device__ void operator()(std::uint32_t i) const {
    const std::uint32_t lit = emitters.triangle_count, outside = emitters.punctual_end();
    if (i < area_count) {
      primaries[i] = draw_primary(emitters, area[i], 0, lit);
    } else if (i < area_count + punctual_count) {
      primaries[i] = draw_primary(emitters, punctual[i - area_count], lit, outside);
    } else {
      primaries[i] = draw_primary(emitters, sky[i - area_count - punctual_count], outside, emitters.entry_count());
    }
  }
};

struct MakeAreaLights {
  SceneView scene;
  EmitterView emitters;
  const PrimarySample* primaries;
  double count;
  Vpl* made;
  std::uint32_t* kept;

  __device__ void operator()(std::uint32_t i) const {
    const PrimarySample p = primaries[i];
    const AreaSample s = sample_area(scene, emitters, p.entry, p.start, p.side);
    made[i] = {s.position, s.axis, s.intensity * static_cast<float>(1 / (p.probability * count))};  // (3.4)
    kept[i] = carries_light(made[i].intensity) ? 1 : 0;
  }
};

struct MakeSkyLights {
  EmitterView emitters;
  const PrimarySample* primaries;
  float count;
  DirectionalLight* made;
  std::uint32_t* kept;

  __device__ void operator()(std::uint32_t i) const {
    const EnvironmentSample sky = sample_environment(emitters.environment, primaries[i].start.x, primaries[i].start.y);
    made[i] = {-sky.direction, sky.radiance / (sky.pdf * count)};
    kept[i] = carries_light(made[i].irradiance) ? 1 : 0;
  }
};

/// Closes the gaps of lights that carry nothing.
template <class Light>
struct Compact {
  const Light* made;
  const std::uint32_t* kept;
  const std::uint32_t* places;
  Light* out;
  __device__ void operator()(std::uint32_t i) const {
    if (kept[i]) out[places[i]] = made[i];
  }
};

/// Follows path i and gives every VPL it leaves to `sink`.
struct LightPaths {
  DeviceTracer tracer;
  EmitterView emitters;
  Streams streams;
  LightPathOptions options;
  float flux_scale = 1;  ///< of paths that choose their emitter themselves
  // The study's layout, where `primaries` is set: paths_each of them a sample, scaled by its kind.
  const PrimarySample* primaries = nullptr;
  std::uint32_t paths_each = 1;
  float area_scale = 1, punctual_scale = 1, sky_scale = 1;

  template <class Sink>
  __device__ void operator()(std::uint32_t i, Sink&& sink) const {
    const auto keep = [&](const Vpl& vpl) {
      if (carries_light(vpl.intensity)) sink(vpl);
    };
    if (primaries == nullptr) {
      trace_light_path_of_stream(tracer.scene, emitters, tracer, streams[i], flux_scale, options, keep);
      return;
    }
    const PrimarySample p = primaries[i / paths_each];
    const bool area = p.entry < emitters.triangle_count, sky = p.entry >= emitters.punctual_end();
    const float scale = area ? area_scale : sky ? sky_scale : punctual_scale;
    trace_light_path_of_primary(tracer.scene, emitters, tracer, p, streams[i], scale, options, keep);
  }
};

struct CountVpls {
  LightPaths paths;
  std::uint32_t* counts;
  __device__ void operator()(std::uint32_t i) const {
    std::uint32_t count = 0;
    paths(i, [&](const Vpl&) { ++count; });
    counts[i] = count;
  }
};

/// VPLs in the order in which threads happened to leave them, with what their place will be.
struct Shelf {
  struct Owner {
    std::uint32_t path, number;  ///< the path's how many-th
  };
  Vpl* vpls = nullptr;
  Owner* owners = nullptr;
  std::uint32_t* used = nullptr;  ///< places asked for
  std::uint32_t capacity = 0;
};

/// Counts, and leaves the VPLs on the shelf: so paths need not be traced once more to be written in order.
struct ShelveVpls {
  LightPaths paths;
  std::uint32_t* counts;
  Shelf shelf;
  __device__ void operator()(std::uint32_t i) const {
    std::uint32_t count = 0;
    paths(i, [&](const Vpl& vpl) {
      const std::uint32_t place = atomicAdd(shelf.used, 1u);
      if (place < shelf.capacity) {
        shelf.vpls[place] = vpl;
        shelf.owners[place] = {i, count};
      }
      ++count;
    });
    counts[i] = count;
  }
};

/// Brings the shelf's VPLs into the order of paths.
struct OrderVpls {
  Shelf shelf;
  const std::uint32_t* places;  ///< of each path's first
  Vpl* out;
  __device__ void operator()(std::uint32_t i) const {
    const Shelf::Owner owner = shelf.owners[i];
    out[places[owner.path] + owner.number] = shelf.vpls[i];
  }
};

/// Where the shelf was too small, or there was no room for one.
struct WriteVpls {
  LightPaths paths;
  const std::uint32_t* places;
  Vpl* out;
  __device__ void operator()(std::uint32_t i) const {
    Vpl* next = out + places[i];
    paths(i, [&](const Vpl& vpl) { *next++ = vpl; });
  }
};

/// Keeps an even share of the VPLs along the order of paths, from a random start (see the CPU's thin_out).
struct ThinOut {
  const Vpl* made;
  Vpl* out;
  double step, start;
  __device__ void operator()(std::uint32_t j) const {
    const double before = start + step * j, after = start + step * (j + 1.0);
    if (!(std::floor(after) > std::floor(before))) return;
    Vpl vpl = made[j];
    vpl.intensity *= static_cast<float>(1 / step);
    out[static_cast<std::uint32_t>(std::floor(before) - std::floor(start))] = vpl;
  }
};

/// Everything the stages below share.
class VplTracing {
 public:
  VplTracing(Device& device, const TracedScene& traced, const EmitterPowers& powers, const VplOptions& options)
      : executor_(device), device_(device), traced_(traced), powers_(powers), options_(options) {
    path_.bounces = std::min(options.bounces, kMaxBounces);
    if (options.deposit == Deposit::study)
      path_.study_distance_sq = options.deposit_distance * options.deposit_distance;
  }

  DeviceLights counted() {
    const std::uint64_t n = options_.count;
    const bool samples = powers_.area + powers_.sky > 0;
    const std::uint64_t primary = !samples ? 0 : options_.bounces == 0 ? n : std::max<std::uint64_t>(1, (n + 2) / 4);
    shares_ = share_by_power(primary, powers_.area, 0, powers_.sky);
    draw_primaries();
    make_primary_lights();
    if (options_.bounces == 0) return finish({}, 0);
    const std::uint64_t wanted = std::max<std::uint64_t>(1, n - std::min(n, shares_.total()));
    lights_.path_count = paths_for(wanted, fly_pilot(wanted));
    LightPaths paths = light_paths(options_.seed);
    paths.flux_scale = static_cast<float>(1.0 / static_cast<double>(lights_.path_count));
    auto [made, count] = trace(paths, static_cast<std::uint32_t>(lights_.path_count), wanted);
    if (needs_thinning(count, wanted)) {
      DeviceBuffer<Vpl> kept(device_, wanted + 1);
      const double step = static_cast<double>(wanted) / count;
      const double start = philox(0, 0, 0, derive_seed(options_.seed, vpl_thinning)).unit_double(0);
      executor_.for_each(count, ThinOut{made.data(), kept.data(), step, start});
      const double total = std::floor(start + step * count) - std::floor(start);
      return finish(std::move(kept), static_cast<std::uint32_t>(total));
    }
    return finish(std::move(made), count);
  }

  DeviceLights study_layout() {
    shares_ = share_by_power(options_.primary_lights, powers_.area, powers_.punctual, powers_.sky);
    draw_primaries();
    make_primary_lights();
    if (options_.bounces == 0) return finish({}, 0);
    const auto k = static_cast<double>(options_.vpls_per_light);
    const auto scale = [&](std::uint64_t of_kind) {
      return of_kind == 0 ? 0.0f : static_cast<float>(1.0 / (static_cast<double>(of_kind) * k));
    };
    lights_.path_count = shares_.total() * options_.vpls_per_light;
    LightPaths paths = light_paths(options_.seed);
    paths.primaries = primaries_.data();
    paths.paths_each = static_cast<std::uint32_t>(options_.vpls_per_light);
    paths.area_scale = scale(shares_.area);
    paths.punctual_scale = scale(shares_.punctual);
    paths.sky_scale = scale(shares_.sky);
    auto [made, count] = trace(paths, static_cast<std::uint32_t>(lights_.path_count), 4 * lights_.path_count);
    return finish(std::move(made), count);
  }

 private:
  [[nodiscard]] Streams streams(std::uint64_t seed) const { return {seed, options_.sequence == Sequence::sobol}; }
  [[nodiscard]] LightPaths light_paths(std::uint64_t seed) const {
    LightPaths paths;
    paths.tracer = {traced_.scene, traced_.bvh};
    paths.emitters = traced_.emitters;
    paths.streams = streams(seed);
    paths.options = path_;
    return paths;
  }

  void draw_primaries() {
    primaries_ = DeviceBuffer<PrimarySample>(device_, shares_.total());
    const auto of = [&](VplPurpose purpose) { return streams(derive_seed(options_.seed, purpose)); };
    executor_.for_each(static_cast<std::uint32_t>(shares_.total()),
                       DrawPrimaries{traced_.emitters, of(area_samples), of(punctual_samples), of(sky_samples),
                                     static_cast<std::uint32_t>(shares_.area),
                                     static_cast<std::uint32_t>(shares_.punctual), primaries_.data()});
  }

  template <class Light, class Make>
  std::uint32_t make_compact(std::uint32_t count, const Make& make, DeviceBuffer<Light>& out) {
    out = DeviceBuffer<Light>(device_, count);
    DeviceBuffer<Light> made(device_, count);
    DeviceBuffer<std::uint32_t> kept(device_, count), places(device_, count);
    executor_.for_each(count, make(made.data(), kept.data()));
    const std::uint32_t total = executor_.exclusive_scan(kept.data(), places.data(), count);
    executor_.for_each(count, Compact<Light>{made.data(), kept.data(), places.data(), out.data()});
    return total;
  }

  void make_primary_lights() {
    lights_.primary_count = make_compact(
        static_cast<std::uint32_t>(shares_.area),
        [&](Vpl* made, std::uint32_t* kept) {
          return MakeAreaLights{
              traced_.scene, traced_.emitters, primaries_.data(), static_cast<double>(shares_.area), made, kept};
        },
        area_lights_);
    const PrimarySample* sky = primaries_.data() + shares_.area + shares_.punctual;
    lights_.sky_count = make_compact(
        static_cast<std::uint32_t>(shares_.sky),
        [&](DirectionalLight* made, std::uint32_t* kept) {
          return MakeSkyLights{traced_.emitters, sky, static_cast<float>(shares_.sky), made, kept};
        },
        sky_lights_);
  }

  VplPilot fly_pilot(std::uint64_t wanted) {
    const auto paths = static_cast<std::uint32_t>(pilot_path_count(wanted));
    DeviceBuffer<std::uint32_t> counts(device_, paths);
    executor_.for_each(paths, CountVpls{light_paths(derive_seed(options_.seed, pilot_paths)), counts.data()});
    std::vector<std::uint32_t> found(paths);
    counts.download(found.data(), paths);
    double sum = 0, sum_sq = 0;
    for (const double c : found) sum += c, sum_sq += c * c;
    return make_pilot(paths, sum, sum_sq);
  }

  /// @param expected  VPLs, about
  std::pair<DeviceBuffer<Vpl>, std::uint32_t> trace(const LightPaths& paths, std::uint32_t path_count,
                                                    std::uint64_t expected) {
    DeviceBuffer<std::uint32_t> counts(device_, path_count), places(device_, path_count), used(device_, 1);
    DeviceBuffer<Vpl> shelved;
    DeviceBuffer<Shelf::Owner> owners;
    used.fill_bytes(0);
    const std::uint64_t capacity = expected + expected / 8 + 1024;
    constexpr std::uint64_t each = 2 * sizeof(Vpl) + sizeof(Shelf::Owner);  // ordered, too
    if (capacity < 1u << 31 && device_.used() + 2 * capacity * each < device_.limit()) {
      shelved = DeviceBuffer<Vpl>(device_, capacity);
      owners = DeviceBuffer<Shelf::Owner>(device_, capacity);
    }
    const Shelf shelf{shelved.data(), owners.data(), used.data(), static_cast<std::uint32_t>(shelved.size())};
    executor_.for_each(path_count, ShelveVpls{paths, counts.data(), shelf});
    const std::uint32_t total = executor_.exclusive_scan(counts.data(), places.data(), path_count);
    if (total > shelf.capacity) {  // of no use, and its room is needed
      shelved = DeviceBuffer<Vpl>();
      owners = DeviceBuffer<Shelf::Owner>();
    }
    DeviceBuffer<Vpl> made(device_, total);
    if (total <= shelf.capacity) {
      executor_.for_each(total, OrderVpls{shelf, places.data(), made.data()});
    } else {
      executor_.for_each(path_count, WriteVpls{paths, places.data(), made.data()});
    }
    return {std::move(made), total};
  }

  DeviceLights finish(DeviceBuffer<Vpl> path_vpls, std::uint32_t count) {
    const auto copy = [&](auto* to, const auto* from, std::size_t n) {
      if (n == 0) return;
      check(cudaMemcpyAsync(to, from, n * sizeof(*to), cudaMemcpyDeviceToDevice, device_.stream()), "joining lights");
    };
    lights_.vpl_count = static_cast<std::uint32_t>(lights_.primary_count) + count;
    lights_.vpls = DeviceBuffer<Vpl>(device_, lights_.vpl_count);
    copy(lights_.vpls.data(), area_lights_.data(), lights_.primary_count);
    copy(lights_.vpls.data() + lights_.primary_count, path_vpls.data(), count);
    lights_.directional_count = static_cast<std::uint32_t>(lights_.sky_count);
    lights_.directionals = std::move(sky_lights_);
    return std::move(lights_);
  }

  CudaExecutor executor_;
  Device& device_;
  const TracedScene& traced_;
  const EmitterPowers& powers_;
  const VplOptions& options_;
  LightPathOptions path_;
  VplShares shares_;
  DeviceBuffer<PrimarySample> primaries_;
  DeviceBuffer<Vpl> area_lights_;
  DeviceBuffer<DirectionalLight> sky_lights_;
  DeviceLights lights_;
};

/// The scene's own punctual lights, behind what was sampled.
void add_punctual_lights(Device& device, const Scene& scene, DeviceLights& lights) {
  std::vector<PointLight> points;
  for (const PointLight& p : scene.point_lights) {
    if (carries_light(p.intensity)) points.push_back(p);
  }
  lights.points = DeviceBuffer<PointLight>(device, points.size());
  lights.points.upload(points.data(), points.size());
  lights.point_count = static_cast<std::uint32_t>(points.size());

  std::vector<DirectionalLight> directionals;
  for (const DirectionalLight& d : scene.directional_lights) {
    if (carries_light(d.irradiance)) directionals.push_back(d);
  }
  const std::size_t sky = lights.directional_count;
  DeviceBuffer<DirectionalLight> all(device, sky + directionals.size());
  if (sky > 0) {
    check(cudaMemcpyAsync(all.data(), lights.directionals.data(), sky * sizeof(DirectionalLight),
                          cudaMemcpyDeviceToDevice, device.stream()),
          "joining lights");
  }
  if (!directionals.empty()) {
    check(cudaMemcpyAsync(all.data() + sky, directionals.data(), directionals.size() * sizeof(DirectionalLight),
                          cudaMemcpyHostToDevice, device.stream()),
          "sending lights");
  }
  device.synchronize();  // the host's copies end here
  lights.directionals = std::move(all);
  lights.directional_count = static_cast<std::uint32_t>(sky + directionals.size());
}

}  // namespace

DeviceLights trace_vpls(Device& device, const TracedScene& traced, const EmitterPowers& powers, const Scene& scene,
                        const VplOptions& options) {
  check_vpl_options(options);
  VplTracing tracing(device, traced, powers, options);
  DeviceLights lights = options.primary_lights > 0 ? tracing.study_layout() : tracing.counted();
  add_punctual_lights(device, scene, lights);
  return lights;
}

}  // namespace lightcuts::cuda
