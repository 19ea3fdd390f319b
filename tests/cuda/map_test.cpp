// Surface points, shadow maps, hole filling and lighting by maps on a GPU, against the CPU's.

#include <gmock/gmock.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <random>

#include "backend/emitter_table.h"
#include "cpu/ism/fill_holes.h"
#include "cuda/device_fixture.h"
#include "cuda/device_scene.h"
#include "cuda/fill_atlas.h"
#include "cuda/light_by_maps.h"
#include "cuda/map_sum_kernels.h"
#include "ism/map_scene.h"
#include "kernels/draw_map.h"
#include "lightcuts/error.h"
#include "lightcuts/io.h"

namespace lightcuts::cuda {
namespace {

template <class T>
std::vector<T> fetch(const T* data, std::size_t count) {
  std::vector<T> values(count);
  check(cudaDeviceSynchronize(), "waiting");
  if (count > 0) check(cudaMemcpy(values.data(), data, count * sizeof(T), cudaMemcpyDeviceToHost), "fetching");
  return values;
}

/// A scene with the same lights in both memories.
struct BothScenes {
  Device& device;
  MapScene host;
  SceneArrays arrays;
  DeviceScene scene;
  DeviceEdges edges;
  DeviceBuffer<Vpl> vpls;
  DeviceBuffer<PointLight> points;
  DeviceBuffer<DirectionalLight> directionals;

  BothScenes(Device& d, Scene s, std::uint64_t count)
      : device(d),
        host(std::move(s)),
        arrays(host.scene),
        scene(d, host.scene, arrays.view()),
        edges(d, arrays.view()) {
    host.trace(count);
  }

  /// VPLs, two point lights, a narrow spot and two directional lights.
  void add_all_kinds() {
    Lights lights = host.lights;
    const Box bounds = scene_bounds(host.scene);
    PointLight light;
    light.intensity = {1, 2, 3};
    for (const float at : {0.3f, 0.55f}) {
      light.position = bounds.lo + (bounds.hi - bounds.lo) * Vec3{at, 0.6f, at};
      lights.points.push_back(light);
    }
    light.axis = normalize(Vec3{0.2f, -1, 0.1f});
    light.cos_outer = 0.6f;
    light.cos_inner = 0.8f;
    lights.points.push_back(light);
    lights.directionals.push_back({normalize(Vec3{0.3f, -1, 0.2f}), {1, 1, 1}});
    lights.directionals.push_back({Vec3{0, -1, 0}, {0.5f, 1, 1}});
    host.set(lights);
  }

  LightArrays upload() {
    const Lights& l = host.lights;
    vpls = DeviceBuffer<Vpl>(device, l.vpls.size());
    points = DeviceBuffer<PointLight>(device, l.points.size());
    directionals = DeviceBuffer<DirectionalLight>(device, l.directionals.size());
    vpls.upload(l.vpls.data(), l.vpls.size());
    points.upload(l.points.data(), l.points.size());
    directionals.upload(l.directionals.data(), l.directionals.size());
    device.synchronize();
    return {vpls.data(),
            points.data(),
            directionals.data(),
            static_cast<std::uint32_t>(l.vpls.size()),
            static_cast<std::uint32_t>(l.points.size()),
            static_cast<std::uint32_t>(l.directionals.size())};
  }
};

/// Leaves on a quad: half of it is cut away.
Scene masked_scene() {
  Scene scene = make_builtin_scene("cornell");
  Material leaf;
  leaf.alpha_mode = AlphaMode::mask;
  leaf.alpha_cutoff = 0.5f;
  Mesh mesh;
  const Box bounds = scene_bounds(scene);
  const Vec3 c = center(bounds), h = (bounds.hi - bounds.lo) * 0.2f;
  mesh.positions = {c + Vec3{-h.x, 0, -h.z}, c + Vec3{h.x, 0, -h.z}, c + Vec3{h.x, 0.1f, h.z},
                    c + Vec3{-h.x, 0.1f, h.z}};
  mesh.colors = {{255, 255, 255, 255}, {255, 255, 255, 0}, {255, 255, 255, 0}, {255, 255, 255, 255}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.material = static_cast<std::uint32_t>(scene.materials.size());
  scene.materials.push_back(leaf);
  scene.meshes.push_back(mesh);
  Instance instance;
  instance.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
  scene.instances.push_back(instance);
  instance.world_from_object.origin = {0, 0.05f * h.y, 0.1f * h.z};
  instance.world_from_object.x = {-1, 0, 0};  // mirrored
  instance.world_from_object.origin.x = 2 * c.x;
  scene.instances.push_back(instance);
  return scene;
}

Scene scene_named(const std::string& name) { return name == "masked" ? masked_scene() : make_builtin_scene(name); }

// --- Points ---

class PointsOnScene : public OnDevice, public testing::WithParamInterface<const char*> {};

TEST_P(PointsOnScene, AreTheCpus) {
  BothScenes both(*device, scene_named(GetParam()), 10);
  for (const std::uint32_t per_map : {1u, 777u, reduced() ? 1000u : 20000u}) {
    const SurfacePoints expected(both.host.cpu_scene.view(), {per_map});
    const DevicePoints made(*device, both.scene.view(), both.edges, per_map, 1);
    ASSERT_EQ(made.view().count, expected.size());
    EXPECT_NEAR(made.area() / expected.area(), 1, 1e-9);
    const auto points = fetch(made.view().points, made.view().count);
    const auto radii = fetch(made.view().radii, made.view().count);
    std::uint32_t edge_count = 0;
    for (const SurfacePoint& p : points) {
      if (p.cuts != 0) edge_count = std::max(edge_count, first_edge(p.cuts) + kDiscEdges);
    }
    const auto edges = fetch(made.view().edges, edge_count);
    std::size_t differ = 0, edges_near = 0;
    const float scale = diagonal(both.arrays.view().bounds);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const DiscShape& shape = expected.arrays().shapes[expected.arrays().shape[i]];
      bool same = length(points[i].position - expected.position(i)) < 1e-5f * scale &&
                  length(points[i].normal - expected.normal(i)) < 1e-4f &&
                  std::abs(radii[i] / shape.radius - 1) < 1e-5f;
      for (int e = 0; e < kDiscEdges; ++e) {
        const float inside = dot(shape.inward[e], expected.position(i)) - shape.offset[e] - shape.radius;
        const bool is_near = (near_edges(points[i].cuts) >> e & 1u) != 0;
        const bool cuts = !(shape.inward[e] == Vec3{}) && inside < 0;
        same = same && (is_near == cuts || std::abs(inside) < 1e-5f * scale);
        if (!is_near) continue;
        ++edges_near;
        const DiscEdge& edge = edges[first_edge(points[i].cuts) + static_cast<std::uint32_t>(e)];
        same = same && length(edge.inward - shape.inward[e]) < 1e-3f &&
               std::abs(edge.offset - shape.offset[e]) < 1e-4f * scale;
      }
      differ += same ? 0 : 1;
    }
    std::printf("  %s: %zu of %zu points differ, %zu edges near\n", GetParam(), differ, points.size(), edges_near);
    EXPECT_LE(differ, points.size() / 2000);  // at the rounding of an area, or of the way to an edge
    const DevicePoints again(*device, both.scene.view(), both.edges, per_map, 1);
    const auto repeated = fetch(again.view().points, again.view().count);
    EXPECT_EQ(std::memcmp(points.data(), repeated.data(), points.size() * sizeof(SurfacePoint)), 0);
  }
}
INSTANTIATE_TEST_SUITE_P(Scenes, PointsOnScene,
                         testing::Values("cornell", "masked", "study", "interior", "lamps?count=100"));

// --- Maps ---

/// How many texels of a map of each light differ from the CPU's: by more than one code, and by one.
struct MapDifference {
  double texels = 0, off = 0, by_one = 0, empty = 0;

  void add(const std::vector<std::uint32_t>& a, const std::vector<std::uint32_t>& b, std::uint32_t none) {
    for (std::size_t i = 0; i < a.size(); ++i) {
      texels += 1;
      const std::uint32_t lo = std::min(a[i], b[i]), hi = std::max(a[i], b[i]);
      // 32-bit codes are as fine as a float: a unit of its rounding is one code, and more of them are a hundred.
      if (hi - lo > (none > 0xffff ? 200u : 1u)) off += 1;
      if (hi != lo) by_one += 1;
      if (b[i] == none) empty += 1;
    }
  }
};

std::vector<std::uint32_t> codes_of(const MapSetView& maps, std::uint32_t slot) {
  const std::size_t texels = static_cast<std::size_t>(maps.size) * static_cast<std::size_t>(maps.size);
  if (maps.depth_bits == 32) return fetch(static_cast<const std::uint32_t*>(maps.codes) + slot * texels, texels);
  const auto codes = fetch(static_cast<const std::uint16_t*>(maps.codes) + slot * texels, texels);
  return {codes.begin(), codes.end()};
}

class MapsOnDevice : public OnDevice {
 protected:
  /// Makes all maps of both and compares; returns the share of texels that are off.
  double compare(BothScenes& both, std::uint32_t per_map, const ShadowMapOptions& options) {
    const LightArrays lights = both.upload();
    const Maps expected(both.host, per_map, options, every_light(both.host.light_set));
    const DevicePoints points(*device, both.scene.view(), both.edges, per_map, 1);
    const MapOptions same{options.size, options.depth_bits, options.levels, options.fill, options.choice, options.seed};
    DeviceMaps maps(*device, same, lights, static_cast<std::uint32_t>(MapMaker::maps_of(both.host.light_set)));
    maps.add_vpls(points.view(), {nullptr, 0, lights.vpl_count});
    maps.add_points(points.view(), {nullptr, 0, lights.point_count});
    maps.add_directionals(points.view(), {nullptr, 0, lights.directional_count});
    EXPECT_EQ(maps.count(), expected.set.map_count());
    EXPECT_EQ(maps.bytes(), expected.set.bytes());

    const std::uint32_t none = options.depth_bits == 16 ? kNoDepth<std::uint16_t> : kNoDepth<std::uint32_t>;
    MapDifference difference;
    const auto add = [&](LightKind kind, std::uint32_t light, int which, const std::uint32_t* slots) {
      const std::uint32_t slot = fetch(slots + light, 1)[0] + static_cast<std::uint32_t>(which);
      difference.add(codes_of(maps.view(), slot), expected.set.codes_of(kind, light, which), none);
    };
    for (std::uint32_t i = 0; i < lights.vpl_count; ++i) add(LightKind::vpl, i, 0, maps.view().vpl_slots);
    for (std::uint32_t i = 0; i < lights.point_count; ++i) {
      const int count = point_map_count(both.host.lights.points[i].cos_outer);
      for (int which = 0; which < count; ++which) add(LightKind::point, i, which, maps.view().point_slots);
    }
    for (std::uint32_t i = 0; i < lights.directional_count; ++i) {
      add(LightKind::directional, i, 0, maps.view().directional_slots);
    }
    std::printf("  %d texels, %u points, %d bits, %d levels: %.4f %% off, %.2f %% by a code, %.0f %% empty\n",
                options.size, per_map, options.depth_bits, options.levels, 100 * difference.off / difference.texels,
                100 * difference.by_one / difference.texels, 100 * difference.empty / difference.texels);
    return difference.texels > 0 ? difference.off / difference.texels : 0;
  }
};

TEST_F(MapsOnDevice, AreTheCpusInEveryMode) {
  BothScenes both(*device, make_builtin_scene("study"), reduced() ? 20 : 100);
  both.add_all_kinds();
  for (const int bits : {16, 32}) {
    for (const HoleFill fill : {HoleFill::edges, HoleFill::mean}) {
      for (const PointChoice choice : {PointChoice::block, PointChoice::noise}) {
        ShadowMapOptions options;
        options.size = 32;
        options.depth_bits = bits;
        options.fill = fill;
        options.choice = choice;
        EXPECT_LT(compare(both, 1000, options), 2e-3);
      }
    }
  }
}

TEST_F(MapsOnDevice, AreTheCpusAtEverySize) {
  BothScenes both(*device, scene_named("masked"), 12);
  both.add_all_kinds();
  for (const int size : {4, 8, 16, 32, 64, 128, 256}) {
    if (reduced() && size > 64) break;
    ShadowMapOptions options;
    options.size = size;
    options.levels = size == 16 ? 0 : size == 64 ? 10 : 2;
    EXPECT_LT(compare(both, size == 8 ? 1 : 1001, options), 2e-3);
  }
}

TEST_F(MapsOnDevice, OfOneLightAndOfNone) {
  BothScenes both(*device, make_builtin_scene("cornell"), 1);
  ShadowMapOptions options;
  both.host.lights.vpls.resize(1);
  both.host.set(both.host.lights);
  EXPECT_LT(compare(both, 8000, options), 2e-3);
  both.host.set({});
  compare(both, 100, options);
}

TEST_F(MapsOnDevice, DoNotDependOnTheOthersOrOnTheRun) {
  BothScenes both(*device, make_builtin_scene("interior"), reduced() ? 40 : 300);
  const LightArrays lights = both.upload();
  const DevicePoints points(*device, both.scene.view(), both.edges, 500, 1);
  MapOptions options;
  options.size = 32;
  DeviceMaps all(*device, options, lights, lights.vpl_count), some(*device, options, lights, lights.vpl_count);
  all.add_vpls(points.view(), {nullptr, 0, lights.vpl_count});
  std::vector<std::uint32_t> ids;
  for (std::uint32_t i = lights.vpl_count; i-- > 0;) {
    if (i % 7 == 3) ids.push_back(i);
  }
  DeviceBuffer<std::uint32_t> wanted(*device, ids.size());
  wanted.upload(ids.data(), ids.size());
  some.add_vpls(points.view(), {nullptr, 0, 2});
  some.add_vpls(points.view(), {wanted.data(), 0, static_cast<std::uint32_t>(ids.size())});
  const auto slots = fetch(some.view().vpl_slots, lights.vpl_count);
  for (const std::uint32_t id : ids) {
    ASSERT_NE(slots[id], kNone);
    EXPECT_EQ(codes_of(some.view(), slots[id]), codes_of(all.view(), id)) << id;
  }
  EXPECT_EQ(slots[2], kNone);
  EXPECT_EQ(some.count(), 2 + ids.size());
}

// --- Filling an atlas ---

TEST_F(OnDevice, FillsAnAtlasAsTheCpuDoes) {
  std::mt19937 dice(7);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const int size : {1, 2, 3, 5, 33, 127, 128, 1000, reduced() ? 384 : 1408}) {
    for (const double filled : {0.02, 0.6, 1.0}) {
      for (const HoleFill fill : {HoleFill::mean, HoleFill::edges}) {
        for (const int levels : {0, 1, 2, 5}) {
          if (size > 500 && levels != 2) continue;
          std::vector<std::uint16_t> atlas(static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
          for (std::uint16_t& code : atlas) {
            const double surface = unit(dice) < 0.5 ? 0.2 : 0.8;
            code = unit(dice) < filled ? static_cast<std::uint16_t>((surface + 0.1 * unit(dice)) * 65534)
                                       : kNoDepth<std::uint16_t>;
          }
          DeviceBuffer<std::uint16_t> codes(*device, atlas.size()), at_once(*device, atlas.size());
          DeviceBuffer<std::uint16_t> scratch(*device, atlas_scratch(size, levels) + 1);
          codes.upload(atlas.data(), atlas.size());
          at_once.upload(atlas.data(), atlas.size());
          scratch.fill_bytes(0x5a);
          FillScratch<std::uint16_t> work;
          fill_holes(atlas.data(), size, levels, fill, work);
          fill_atlas(*device, codes.data(), size, levels, fill, scratch.data());
          device->synchronize();
          EXPECT_EQ(fetch(codes.data(), atlas.size()), atlas) << size << ", levels " << levels;
          if (fill != HoleFill::mean || levels != 2) continue;
          fill_atlas_at_once(*device, at_once.data(), size);
          device->synchronize();
          EXPECT_EQ(fetch(at_once.data(), atlas.size()), atlas) << size << ", at once";
        }
      }
    }
  }
}

// --- Plans ---

TEST(MapPlan, TakesWhatFits) {
  EXPECT_EQ(plan_maps_at_once(1 << 20, 1 << 10, 2048, 100, 32), 100u);
  EXPECT_EQ(plan_maps_at_once(1 << 20, 1 << 10, 2048, 0, 32), 0u);
  // Whole blocks of lights, each with two maps.
  EXPECT_EQ(plan_maps_at_once(3 << 20, 0, 2048, 1 << 20, 32), 1536u - 1536u % (2 * kSumBlockLights));
  EXPECT_EQ(plan_maps_at_once(2048 * 100, 0, 2048, 1 << 20, 32), 100u);
}

TEST(MapPlan, SaysWhatIsMissing) {
  try {
    plan_maps_at_once(1 << 20, 1 << 20, 2048, 5, 32);
    FAIL() << "a budget too small for one map was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::out_of_memory);
    EXPECT_THAT(error.what(), testing::HasSubstr("--memory"));
  }
}

}  // namespace
}  // namespace lightcuts::cuda
