#pragma once

#include <tbb/task_arena.h>

#include <memory>
#include <optional>

#include "backend/backend.h"
#include "backend/emitter_table.h"
#include "backend/find_occluders.h"
#include "backend/scene_arrays.h"
#include "cpu/ism/kept_maps.h"
#include "cpu/light_set.h"
#include "cpu/ray_tracer.h"
#include "cpu/simd/isa.h"
#include "cpu/simd/shade_kernels.h"

namespace lightcuts {

/// The stages by threads (oneTBB), SIMD kernels and Embree: the gold that other backends are compared with.
class CpuBackend final : public Backend {
 public:
  /// `threads` 0: one for each processor. Throws Error{invalid_argument} as selected_isa does.
  explicit CpuBackend(int threads);

  [[nodiscard]] std::string device_name() const override;
  void set_scene(const Scene& scene, const ProgressFn& progress) override;
  void scene_relit() override;
  void trace_vpls(const VplOptions& options, const ProgressFn& progress) override;
  void set_lights(Lights lights) override;
  [[nodiscard]] const Lights& lights() override { return lights_; }
  [[nodiscard]] LightCounts light_counts() const override;
  void build_light_tree(const TreeOptions& options, const ProgressFn& progress) override;
  void set_light_tree(LightTrees trees) override;
  [[nodiscard]] const LightTrees& light_trees() override { return trees_; }
  [[nodiscard]] TreeCounts tree_counts() const override;
  ShadeResult shade(const Camera& camera, int width, int height, const ShadeOptions& options,
                    std::uint64_t memory_bytes, Statistics& statistics, const ProgressFn& progress) override;
  void forget_maps() override { kept_.forget(); }
  [[nodiscard]] std::uint64_t kept_bytes() const override { return kept_.bytes(); }
  [[nodiscard]] StageCounts stage_counts() const override { return counts_; }

 private:
  /// What a scene turns into; kept together because each part refers to the one before.
  struct Loaded {
    explicit Loaded(const Scene& scene)
        : cpu_scene(scene),
          tracer(cpu_scene.view()),
          emitters(std::in_place, cpu_scene),
          occluders(find_occluders(cpu_scene.view(), kMostOccluders)) {}
    SceneArrays cpu_scene;
    RayTracer tracer;
    std::optional<EmitterTable> emitters;
    std::vector<Occluder> occluders;
  };

  Loaded& loaded();
  ShadeResult shade_picture(const Camera& camera, int width, int height, const ShadeOptions& options,
                            std::uint64_t memory_bytes, Statistics& statistics, const ProgressFn& progress);

  Isa isa_;
  const ShadeKernels& kernels_;
  tbb::task_arena arena_;
  std::unique_ptr<Loaded> loaded_;
  Lights lights_;
  LightSet light_set_;
  Lights last_lights_;  ///< those that maps were kept of, while there are no others yet
  LightSet last_light_set_;
  KeptMaps kept_;
  LightTrees trees_;
  std::optional<std::uint64_t> drawn_with_;  ///< the seed of the trees' representatives; none of trees from elsewhere
  StageCounts counts_;
};

}  // namespace lightcuts
