#pragma once

#include <memory>

#include "backend/backend.h"
#include "cuda/device.h"
#include "cuda/device_emitters.h"
#include "cuda/device_scene.h"
#include "cuda/sum_kernels.h"
#include "cuda/vpl_kernels.h"

namespace lightcuts::cuda {

/// The stages on one GPU. What a stage makes stays there; only the picture comes back.
class CudaBackend final : public Backend {
 public:
  /// Opens device `index`; `memory_limit` 0: three quarters of what is free.
  /// Throws Error{no_device, not_built}.
  CudaBackend(int index, std::uint64_t memory_limit);

  [[nodiscard]] std::string device_name() const override;
  void set_scene(const Scene& scene, const ProgressFn& progress) override;
  void trace_vpls(const VplOptions& options, const ProgressFn& progress) override;
  void set_lights(Lights lights) override;
  [[nodiscard]] const Lights& lights() override;
  void build_light_tree(const TreeOptions& options, const ProgressFn& progress) override;
  void set_light_tree(LightTrees trees) override;
  [[nodiscard]] const LightTrees& light_trees() override { return trees_; }
  ShadeResult shade(const Camera& camera, int width, int height, const ShadeOptions& options,
                    std::uint64_t memory_bytes, Statistics& statistics, const ProgressFn& progress) override;

 private:
  struct Loaded;
  Loaded& loaded();

  Device device_;
  std::unique_ptr<Loaded> loaded_;
  DeviceLights device_lights_;
  Lights lights_;
  bool lights_fetched_ = true;
  LightTrees trees_;
};

}  // namespace lightcuts::cuda
