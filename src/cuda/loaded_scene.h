#pragma once

#include <optional>

#include "backend/emitter_table.h"
#include "backend/find_occluders.h"
#include "backend/scene_arrays.h"
#include "cuda/cuda_backend.h"

namespace lightcuts::cuda {

/// A scene, its emitters and their copies on the device.
struct CudaBackend::Loaded {
  Loaded(Device& device, const Scene& loaded_scene)
      : scene(loaded_scene),
        arrays(loaded_scene),
        table(std::in_place, arrays),
        on_device(device, loaded_scene, arrays.view()),
        emitters(device, table->view(), arrays.view().instance_count) {
    place_occluders(device);
  }

  [[nodiscard]] TracedScene traced() const { return {on_device.view(), on_device.bvh(), emitters.view()}; }
  [[nodiscard]] EmitterPowers powers() const {
    const EmitterView& e = table->view();
    return {table->power(0, e.triangle_count), table->power(e.triangle_count, e.punctual_end()),
            table->power(e.punctual_end(), e.entry_count())};
  }

  /// Reads what emits and reflects again.
  void relight(Device& device) {
    arrays.update_materials();
    on_device.update_materials(arrays.view());
    table.emplace(arrays);
    emitters = DeviceEmitters(device, table->view(), arrays.view().instance_count);
  }

  void place_occluders(Device& device) {
    const std::vector<Occluder> found = find_occluders(arrays.view(), kMostOccluders);
    occluders = DeviceBuffer<Occluder>(device, found.size());
    occluders.upload(found.data(), found.size());
    occluder_count = static_cast<std::uint32_t>(found.size());
  }

  /// Made when maps first need them.
  const DeviceEdges& edges(Device& device) {
    if (!hard_edges) hard_edges.emplace(device, arrays.view());
    return *hard_edges;
  }

  /// Points that so many are drawn of for each map; kept until others are asked for.
  const DevicePoints& points(Device& device, std::uint32_t per_map, std::uint64_t seed, StageCounts& counts) {
    if (!has_points(per_map, seed)) {
      ++counts.points;
      surface_points.reset();
      surface_points.emplace(device, on_device.view(), edges(device), per_map, seed);
      points_per_map = per_map;
      points_seed = seed;
    }
    return *surface_points;
  }
  [[nodiscard]] bool has_points(std::uint32_t per_map, std::uint64_t seed) const {
    return surface_points && points_per_map == per_map && points_seed == seed;
  }

  const Scene& scene;
  SceneArrays arrays;
  std::optional<EmitterTable> table;
  DeviceScene on_device;
  DeviceEmitters emitters;
  DeviceBuffer<Occluder> occluders;
  std::uint32_t occluder_count = 0;
  std::optional<DeviceEdges> hard_edges;
  std::optional<DevicePoints> surface_points;
  std::uint32_t points_per_map = 0;
  std::uint64_t points_seed = 0;
};

}  // namespace lightcuts::cuda
