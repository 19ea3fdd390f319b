#include "cuda/cuda_backend.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "backend/vpl_placement.h"
#include "backend/vpl_plan.h"
#include "cuda/loaded_scene.h"
#include "cuda/placement_kernels.h"
#include "lightcuts/error.h"

namespace lightcuts::cuda {
namespace {

Lights download(const DeviceLights& d) {
  Lights lights;
  lights.vpls.resize(d.vpl_count);
  lights.points.resize(d.point_count);
  lights.directionals.resize(d.directional_count);
  d.vpls.download(lights.vpls.data(), d.vpl_count);
  d.points.download(lights.points.data(), d.point_count);
  d.directionals.download(lights.directionals.data(), d.directional_count);
  lights.primary_count = d.primary_count;
  lights.sky_count = d.sky_count;
  lights.path_count = d.path_count;
  return lights;
}

}  // namespace

CudaBackend::CudaBackend(int index, std::uint64_t memory_limit) : device_(index, memory_limit) {}

std::string CudaBackend::device_name() const { return "cuda: " + device_.name(); }

void CudaBackend::set_scene(const Scene& scene, const ProgressFn& progress) {
  drop_maps();
  loaded_.reset();
  device_lights_ = {};
  lights_ = {};
  drop_trees();
  if (progress && !progress("bvh", 0)) return;
  loaded_ = std::make_unique<Loaded>(device_, scene);
  ++counts_.scenes;
  if (progress) progress("bvh", 1);
}

void CudaBackend::scene_relit() {
  loaded().relight(device_);
  drop_trees();
}

CudaBackend::Loaded& CudaBackend::loaded() {
  if (loaded_ == nullptr) throw Error(Code::invalid_argument, "the backend has no scene yet; call set_scene first");
  return *loaded_;
}

/// Runs a stage; where there is too little memory beside maps of the last picture, again without them.
template <class Stage>
auto CudaBackend::beside_maps(Stage stage) {
  try {
    return stage();
  } catch (const Error& error) {
    if (error.code() != Code::out_of_memory || taken_by_maps() == 0) throw;
  }
  drop_maps();
  return stage();
}

void CudaBackend::trace_vpls(const VplOptions& options, const ProgressFn& progress) {
  Loaded& scene = loaded();
  if (!(scene.table->total_power() > 0)) {
    throw Error(Code::no_emitter, "nothing in the scene emits light: add a light or an environment");
  }
  if (progress && !progress("vpls", 0)) return;
  check_vpl_options(options);
  const bool for_camera = options.placement == VplPlacement::camera;
  VplOptions traced_options = options;
  traced_options.placement = VplPlacement::power;
  if (for_camera) traced_options.count = placement_candidates(options.count);
  StageTimer timer(device_, "vpls");
  DeviceLights traced = beside_maps(
      [&] { return cuda::trace_vpls(device_, scene.traced(), scene.powers(), scene.scene, traced_options); });
  if (for_camera && traced.vpl_count + traced.sky_count > options.count) {
    Lights candidates = download(traced);
    const std::vector<float> worth = rate_for_camera(device_, scene.traced(), options, traced);
    traced = {};
    keep_lights(choose_for_camera(worth, candidates, options), candidates);
    set_lights(std::move(candidates));
  } else {
    replace_lights(std::move(traced));
  }
  times_.vpls = timer.ms();
  ++counts_.vpls;
  if (progress) progress("vpls", 1);
}

void CudaBackend::set_lights(Lights lights) {
  DeviceLights on_device;
  on_device.vpl_count = static_cast<std::uint32_t>(lights.vpls.size());
  on_device.point_count = static_cast<std::uint32_t>(lights.points.size());
  on_device.directional_count = static_cast<std::uint32_t>(lights.directionals.size());
  on_device.vpls = DeviceBuffer<Vpl>(device_, lights.vpls.size());
  on_device.points = DeviceBuffer<PointLight>(device_, lights.points.size());
  on_device.directionals = DeviceBuffer<DirectionalLight>(device_, lights.directionals.size());
  on_device.vpls.upload(lights.vpls.data(), lights.vpls.size());
  on_device.points.upload(lights.points.data(), lights.points.size());
  on_device.directionals.upload(lights.directionals.data(), lights.directionals.size());
  on_device.primary_count = lights.primary_count;
  on_device.sky_count = lights.sky_count;
  on_device.path_count = lights.path_count;
  device_.synchronize();
  replace_lights(std::move(on_device));
  lights_ = std::move(lights);
  lights_fetched_ = true;
}

/// Takes other lights; maps of those that have not moved stay.
void CudaBackend::replace_lights(DeviceLights lights) {
  drop_trees();
  all_by_maps_.reset();
  DeviceLights before = std::exchange(device_lights_, std::move(lights));
  lights_ = {};
  lights_fetched_ = false;
  const DeviceLights& now = device_lights_;
  if (light_maps_ && before.vpl_count == now.vpl_count && before.point_count == now.point_count &&
      before.directional_count == now.directional_count) {
    try {
      light_maps_->replace_lights(light_arrays());
    } catch (const Error& error) {
      if (error.code() != Code::out_of_memory) throw;
      light_maps_.reset();
    }
  } else {
    light_maps_.reset();
  }
}

const Lights& CudaBackend::lights() {
  if (!lights_fetched_) lights_ = download(device_lights_);
  lights_fetched_ = true;
  return lights_;
}

LightCounts CudaBackend::light_counts() const {
  const DeviceLights& d = device_lights_;
  return {d.vpl_count, d.point_count, d.directional_count, d.primary_count, d.sky_count, d.path_count};
}

void CudaBackend::drop_maps() {
  light_maps_.reset();
  all_by_maps_.reset();
}

void CudaBackend::forget_maps() {
  drop_maps();
  if (loaded_ != nullptr) loaded_->surface_points.reset();
}

std::uint64_t CudaBackend::taken_by_maps() const {
  return (light_maps_ ? light_maps_->taken_bytes() : 0) + (all_by_maps_ ? all_by_maps_->taken_bytes() : 0);
}
std::uint64_t CudaBackend::maps_made() const {
  return (light_maps_ ? light_maps_->made() : 0) + (all_by_maps_ ? all_by_maps_->made() : 0);
}
double CudaBackend::map_making_ms() const {
  return (light_maps_ ? light_maps_->making_ms() : 0) + (all_by_maps_ ? all_by_maps_->making_ms() : 0);
}

/// Sees to it that there are surface points and room for maps: those of the last picture, where they still serve.
///
/// @param budget  bytes for points and maps, what there is of both included
void CudaBackend::prepare_maps(const ShadeOptions& options, std::uint64_t budget) {
  Loaded& scene = loaded();
  const bool on_demand = options.method == Method::lightcuts;
  const MapOptions maps = map_options(options);
  const auto per_map = static_cast<std::uint32_t>(options.ism_points);
  const std::uint64_t for_points = DevicePoints::bytes_for(per_map, scene.edges(device_).triangle_count());
  const std::uint64_t for_maps = budget - std::min(budget, for_points);
  const bool serves = scene.has_points(per_map, options.seed) &&
                      (on_demand ? light_maps_ && light_maps_->options() == maps && light_maps_->set_budget(for_maps)
                                 : all_by_maps_ && all_by_maps_->options() == maps &&
                                       all_by_maps_->taken_bytes() + kSumByMapsBytes <= for_maps);
  if (serves) return;
  drop_maps();
  const LightArrays lights = light_arrays();
  plan_maps_at_once(budget, for_points + LightMaps::fixed_bytes(device_, maps, lights), DeviceMaps::bytes_per_map(maps),
                    2, options.ism_size);
  StageTimer timer(device_, "surface points");
  const DevicePoints& points = scene.points(device_, per_map, options.seed, counts_);
  if (on_demand) {
    light_maps_.emplace(device_, points, maps, lights, for_maps);
  } else {
    all_by_maps_.emplace(device_, points, lights, maps, for_maps);
  }
  times_.points = timer.ms();
  times_.shadow_maps = times_.points;
}

void CudaBackend::drop_trees() {
  if (light_maps_) light_maps_->trees_changed();
  device_trees_ = {};
  trees_ = {};
  trees_fetched_ = true;
}

void CudaBackend::build_light_tree(const TreeOptions& options, const ProgressFn& progress) {
  const float diagonal = loaded().arrays.view().diagonal;
  drop_trees();
  if (progress && !progress("tree", 0)) return;
  StageTimer timer(device_, "light tree");
  if (options.builder == TreeBuilder::ploc) {
    device_trees_ = beside_maps([&] { return build_light_trees(device_, device_lights_, diagonal, options); });
  } else {
    trees_ = build_trees_by_cpu(lights(), diagonal, options, {});
    device_trees_ = beside_maps([&] { return upload_light_trees(device_, trees_, device_lights_); });
  }
  times_.tree = timer.ms();
  ++counts_.trees;
  trees_fetched_ = false;
  if (progress) progress("tree", 1);
}

void CudaBackend::set_light_tree(LightTrees trees) {
  drop_trees();
  device_trees_ = upload_light_trees(device_, trees, device_lights_);
  trees_ = std::move(trees);
}

const LightTrees& CudaBackend::light_trees() {
  if (!trees_fetched_) trees_ = download_light_trees(device_trees_);
  trees_fetched_ = true;
  return trees_;
}

TreeCounts CudaBackend::tree_counts() const {
  TreeCounts counts;
  for (const DeviceTree& tree : device_trees_.kind) {
    counts.nodes += tree.node_count();
    counts.depth = std::max<std::uint64_t>(counts.depth, tree.depth);
  }
  return counts;
}

void CudaBackend::require_trees() const {
  const DeviceLights& d = device_lights_;
  const DeviceTree* const trees = device_trees_.kind.data();
  if (trees[vpl_kind].leaf_count == d.vpl_count && trees[point_kind].leaf_count == d.point_count &&
      trees[directional_kind].leaf_count == d.directional_count) {
    return;
  }
  throw Error(Code::invalid_argument, "the light trees are not those of the lights; call build_light_tree first");
}

LightArrays CudaBackend::light_arrays() const {
  const DeviceLights& d = device_lights_;
  return {d.vpls.data(), d.points.data(), d.directionals.data(), d.vpl_count, d.point_count, d.directional_count};
}

}  // namespace lightcuts::cuda

namespace lightcuts {

std::unique_ptr<Backend> make_cuda_backend(int device, std::uint64_t memory_limit) {
  return std::make_unique<cuda::CudaBackend>(device, memory_limit);
}

int cuda_device_count() noexcept {
  int count = 0;
  return cudaGetDeviceCount(&count) == cudaSuccess ? count : 0;
}

}  // namespace lightcuts
