// What does everything around a shadow ray cost, beside a bare loop of Embree over the same rays?
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <memory>
#include <stdexcept>
#include <vector>

#include "cpu/all_lights.h"
#include "cpu/benchmarks.h"
#include "cpu/embree.h"
#include "cpu/progress.h"
#include "cpu/ratio.h"
#include "cpu/ray_tracer.h"
#include "cpu/simd/isa.h"
#include "cpu/vpl_tracer.h"

namespace lightcuts::bench {
namespace {

/// Keeps every ray that the renderer traces.
class Recorder final : public PacketVisibility {
 public:
  struct Packet {
    RayPacket16 rays;
    std::uint32_t candidates;
  };
  explicit Recorder(const RayTracer& tracer) : visibility_(tracer) {}
  std::uint32_t shares(const VisibilityQuery& query, float* share) const override {
    packets_.push_back({query.rays, query.candidates});
    const std::uint32_t traced = visibility_.shares(query, share);
    for (int lane = 0; lane < kPacketSize; ++lane) visible_ += share[lane] > 0;
    return traced;
  }
  [[nodiscard]] const std::vector<Packet>& packets() const { return packets_; }
  [[nodiscard]] std::uint64_t visible() const { return visible_; }

 private:
  RayVisibility visibility_;
  mutable std::vector<Packet> packets_;
  mutable std::uint64_t visible_ = 0;
};

/// Embree and nothing else: all triangles of the scene in world space in one geometry.
class BareEmbree {
 public:
  explicit BareEmbree(const SceneView& view) : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
    std::vector<Vec3> corners;
    for (std::uint32_t i = 0; i < view.instance_count; ++i) {
      const MeshView& mesh = view.meshes[view.instances[i].mesh];
      for (std::uint32_t t = 0; t < mesh.triangle_count; ++t) {
        for (const std::uint32_t corner : mesh.triangles[t]) {
          corners.push_back(transform_point(view.instances[i].world_from_object, mesh.positions[corner]));
        }
      }
    }
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<Vec3*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3), corners.size()));
    std::copy(corners.begin(), corners.end(), vertices);
    auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), corners.size() / 3));
    for (std::uint32_t i = 0; i < corners.size(); ++i) indices[i] = i;
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(scene_);
  }
  ~BareEmbree() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  BareEmbree(const BareEmbree&) = delete;
  BareEmbree& operator=(const BareEmbree&) = delete;

  /// Rays as Embree reads and writes them.
  struct alignas(64) Packet {
    RTCRay16 rays;
    alignas(64) int valid[16];
  };
  static Packet prepare(const Recorder::Packet& from) {
    Packet packet{};
    for (unsigned i = 0; i < 16; ++i) {
      packet.rays.org_x[i] = from.rays.ox[i];
      packet.rays.org_y[i] = from.rays.oy[i];
      packet.rays.org_z[i] = from.rays.oz[i];
      packet.rays.tnear[i] = from.rays.t_min[i];
      packet.rays.dir_x[i] = from.rays.dx[i];
      packet.rays.dir_y[i] = from.rays.dy[i];
      packet.rays.dir_z[i] = from.rays.dz[i];
      packet.rays.tfar[i] = from.rays.t_max[i];
      packet.rays.mask[i] = ~0u;
      packet.valid[i] = (from.candidates >> i & 1u) != 0 ? -1 : 0;
    }
    return packet;
  }
  /// Traces all; returns how many rays met nothing.
  std::uint64_t trace(const std::vector<Packet>& packets) const {
    std::uint64_t visible = 0;
    for (const Packet& packet : packets) {
      RTCRay16 rays = packet.rays;
      embree::occluded16(packet.valid, scene_, &rays, embree::Coherence::coherent);
      for (unsigned i = 0; i < 16; ++i) visible += packet.valid[i] != 0 && rays.tfar[i] >= 0;
    }
    return visible;
  }

 private:
  RTCDevice device_;
  RTCScene scene_;
};

struct Case {
  explicit Case(const char* name)
      : scene(make_builtin_scene(name)),
        cpu_scene(scene),
        tracer(cpu_scene.view()),
        emitters(cpu_scene),
        bare(cpu_scene.view()) {
    VplOptions options;
    options.count = 500;
    all_lights = trace_vpls(cpu_scene, emitters, tracer, options);
    lights = make_light_set(all_lights);
    view = make_view(select_camera(scene, ""), 256, 256, 1, 1, true);
    for (int i = 0; i < 16; ++i) {
      tiles.push_back(
          trace_tile(view, 64 * (i % 4) + 24, 64 * (i / 4) + 24, 0, cpu_scene.view(), tracer, emitters.view()));
    }
  }

  Scene scene;
  SceneArrays cpu_scene;
  RayTracer tracer;
  EmitterTable emitters;
  BareEmbree bare;
  Lights all_lights;
  LightSet lights;
  View view;
  std::vector<Tile> tiles;
  std::vector<BareEmbree::Packet> packets;
  std::uint64_t rays = 0;
};

std::uint64_t light_tiles(const Case& c, const PacketVisibility& visibility) {
  const ProgressFn silent;
  Progress progress(silent, "shade", 1);
  const AllLights all_lights(shade_kernels(selected_isa()), c.lights, &visibility, 0.01f);
  std::uint64_t rays = 0;
  for (const Tile& tile : c.tiles) {
    TileLight lit;
    all_lights.light(tile, progress, lit);
    rays += lit.rays;
    benchmark::DoNotOptimize(lit);
  }
  return rays;
}

/// Records the rays, and checks that bare Embree sees the same.
void record_and_check(Case& c) {
  const Recorder recorder(c.tracer);
  c.rays = light_tiles(c, recorder);
  for (const Recorder::Packet& packet : recorder.packets()) c.packets.push_back(BareEmbree::prepare(packet));
  const std::uint64_t visible = c.bare.trace(c.packets);
  const auto difference = static_cast<double>(visible) - static_cast<double>(recorder.visible());
  // Rays that graze an edge may be decided by another order of the same triangles.
  if (std::abs(difference) > 1e-4 * static_cast<double>(c.rays)) {
    throw std::runtime_error(
        fmt::format("{} rays arrive by the renderer, {} by bare Embree", recorder.visible(), visible));
  }
}

void run(benchmark::State& state, const Case& c) {
  const RayVisibility visibility(c.tracer);
  compare_in_turns(
      state, "share_of_bare_embree", [&] { benchmark::DoNotOptimize(c.bare.trace(c.packets)); },
      [&] { light_tiles(c, visibility); }, [](double bare, double ours) { return bare / ours; });
  state.counters["rays"] =
      benchmark::Counter(static_cast<double>(c.rays), benchmark::Counter::kIsIterationInvariantRate);
}

}  // namespace

void register_shadow_rays() {
  static std::vector<std::unique_ptr<Case>> cases;  // the benchmarks run later
  for (const char* name : {"cornell", "study"}) {
    Case* c = cases.emplace_back(std::make_unique<Case>(name)).get();
    record_and_check(*c);
    benchmark::RegisterBenchmark((std::string("shadow_rays/") + name).c_str(),
                                 [c](benchmark::State& state) { run(state, *c); })
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
  }
}

}  // namespace lightcuts::bench
