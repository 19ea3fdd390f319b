#pragma once

#include <memory>

#include "backend/backend.h"
#include "cuda/device.h"
#include "cuda/device_emitters.h"
#include "cuda/device_scene.h"
#include "cuda/group_order.h"
#include "cuda/heap_cut.h"
#include "cuda/light_by_maps.h"
#include "cuda/light_maps.h"
#include "cuda/light_tree.h"
#include "cuda/map_rounds.h"
#include "cuda/sum_kernels.h"
#include "cuda/vpl_kernels.h"

namespace lightcuts::cuda {

/// The stages on one GPU. What a stage makes stays there; only the picture comes back.
class CudaBackend final : public Backend {
 public:
  /// Opens device `index`; `memory_limit` 0: three quarters of what is free.
  /// Throws Error{no_device}.
  CudaBackend(int index, std::uint64_t memory_limit);

  [[nodiscard]] std::string device_name() const override;
  [[nodiscard]] bool has_own_memory() const override { return true; }
  void set_scene(const Scene& scene, const ProgressFn& progress) override;
  void scene_relit() override;
  void trace_vpls(const VplOptions& options, const ProgressFn& progress) override;
  void set_lights(Lights lights) override;
  [[nodiscard]] const Lights& lights() override;
  [[nodiscard]] LightCounts light_counts() const override;
  void build_light_tree(const TreeOptions& options, const ProgressFn& progress) override;
  void set_light_tree(LightTrees trees) override;
  [[nodiscard]] const LightTrees& light_trees() override;
  [[nodiscard]] TreeCounts tree_counts() const override;
  ShadeResult shade(const Camera& camera, int width, int height, const ShadeOptions& options,
                    std::uint64_t memory_bytes, Statistics& statistics, const ProgressFn& progress) override;
  void set_heap_batch(std::uint32_t pixels) override { heap_batch_ = pixels; }
  [[nodiscard]] StageTimes stage_times() const override { return times_; }
  [[nodiscard]] StageCounts stage_counts() const override { return counts_; }
  void forget_maps() override;

 private:
  struct Loaded;
  struct Shading;
  Loaded& loaded();
  void drop_trees();
  void replace_lights(DeviceLights lights);
  [[nodiscard]] LightArrays light_arrays() const;
  void require_trees() const;
  bool shade_paths(Shading& shading);
  bool shade_lights(Shading& shading);
  bool light_sample(Shading& shading);
  bool light_by_cuts(Shading& shading);
  bool light_groups(Shading& shading, const CutJob& job, const SumView& sums, const CutView& cuts);
  bool light_heaps(Shading& shading, const CutJob& job, const SumView& sums, const CutView& cuts);
  LookUpUnit look_up_by(Shading& shading, const CutJob& job, std::uint32_t units_of_tile);
  void drop_maps();
  template <class Stage>
  auto beside_maps(Stage stage);
  void prepare_maps(const ShadeOptions& options, std::uint64_t budget);
  [[nodiscard]] std::uint64_t taken_by_maps() const;
  [[nodiscard]] std::uint64_t maps_made() const;
  [[nodiscard]] double map_making_ms() const;

  Device device_;
  std::unique_ptr<Loaded> loaded_;
  DeviceLights device_lights_;
  Lights lights_;
  bool lights_fetched_ = true;
  std::optional<LightMaps> light_maps_;    ///< of the lights of cuts, as far as they were asked for
  std::optional<MapLighter> all_by_maps_;  ///< all lights' maps
  DeviceTrees device_trees_;
  LightTrees trees_;
  bool trees_fetched_ = true;
  StageTimes times_;
  StageCounts counts_;
  std::uint32_t heap_batch_ = kHeapBatch;
  GroupOrder group_order_;
};

}  // namespace lightcuts::cuda
