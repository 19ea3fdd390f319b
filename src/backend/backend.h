#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "backend/light_tree.h"
#include "lightcuts/lights.h"
#include "lightcuts/render.h"
#include "lightcuts/scene.h"

namespace lightcuts {

/// What shading one picture yields beside its planes.
struct ShadeResult {
  Image image;
  bool complete = true;
};

/// Time that the last run of each stage took on the device [ms]; zeros where it was not measured.
struct StageTimes {
  double vpls = 0, tree = 0, shadow_maps = 0;
  double points = 0;  ///< on the surfaces, a part of shadow_maps; maps of cuts' lights are a part of `light` too
  double pixels = 0;  ///< camera rays
  double light = 0;   ///< choosing and summing lights
  double shade = 0;   ///< the whole picture but for its way to the host
};

/// How many lights there are, and how many paths were traced for them.
struct LightCounts {
  std::uint64_t vpls = 0, points = 0, directionals = 0;
  std::uint64_t primary = 0, sky = 0, paths = 0;  ///< as Lights has them
};

/// Of all light trees together.
struct TreeCounts {
  std::uint64_t nodes = 0, depth = 0;
};

/// How often stages ran since the backend was made, and how many shadow maps were drawn.
struct StageCounts {
  std::uint64_t scenes = 0;  ///< acceleration structures built
  std::uint64_t vpls = 0, trees = 0;
  std::uint64_t points = 0;  ///< on the surfaces, for shadow maps
  std::uint64_t maps = 0;
  std::uint64_t pictures = 0;
};

/// The stages of a picture on some processor. A backend keeps what a stage made (scene, lights, tree) where the next
/// stage needs it, so that a second picture with another camera costs only its shading; every stage's result can also
/// be taken out and put in, so that two backends are compared a stage at a time.
///
/// Order: set_scene, then set_lights or trace_vpls, then set_light_tree or build_light_tree (lightcuts only), then
/// shade as often as wanted. Progress callbacks return false to stop; a stage that was stopped leaves nothing behind,
/// except shade, which returns what it has.
class Backend {
 public:
  virtual ~Backend() = default;

  /// "cpu: AVX-512, 2 threads" or the GPU's name.
  [[nodiscard]] virtual std::string device_name() const = 0;

  /// Whether pictures are made in memory of its own, a GPU's, that budgets of the host's say nothing about.
  [[nodiscard]] virtual bool has_own_memory() const { return false; }

  /// Builds the acceleration structure. The scene must be valid and outlive the backend's use of it.
  virtual void set_scene(const Scene& scene, const ProgressFn& progress) = 0;

  /// Takes note that the scene's emission, reflectances, lights or environment have changed in place, and nothing else:
  /// the acceleration structure stays, lights and trees are forgotten.
  virtual void scene_relit() = 0;

  /// Makes all lights of the sum: samples of area lights and environment, VPLs, punctual lights.
  /// Throws Error{no_emitter}.
  virtual void trace_vpls(const VplOptions& options, const ProgressFn& progress) = 0;
  virtual void set_lights(Lights lights) = 0;
  [[nodiscard]] virtual const Lights& lights() = 0;
  [[nodiscard]] virtual LightCounts light_counts() const = 0;  ///< without fetching the lights

  /// Builds the light trees over the current lights.
  virtual void build_light_tree(const TreeOptions& options, const ProgressFn& progress) = 0;
  virtual void set_light_tree(LightTrees trees) = 0;
  [[nodiscard]] virtual const LightTrees& light_trees() = 0;
  [[nodiscard]] virtual TreeCounts tree_counts() const = 0;  ///< without fetching the trees

  /// Renders. Layers as in RenderResult::image. `statistics` receives cut, clamped, shadow_maps, rays, pairs.
  virtual ShadeResult shade(const Camera& camera, int width, int height, const ShadeOptions& options,
                            std::uint64_t memory_bytes, Statistics& statistics, const ProgressFn& progress) = 0;

  /// How many pixels' heaps a GPU keeps at once for CutWalk::heap; others need not listen.
  virtual void set_heap_batch(std::uint32_t) {}

  /// Gives up the shadow maps and surface points that are kept for the next picture, and how much of the host's memory they
  /// take [bytes].
  virtual void forget_maps() {}
  [[nodiscard]] virtual std::uint64_t kept_bytes() const { return 0; }

  [[nodiscard]] virtual StageTimes stage_times() const { return {}; }
  [[nodiscard]] virtual StageCounts stage_counts() const { return {}; }
};

/// The stages by threads, SIMD and Embree (src/cpu); 0: a thread for each processor.
/// Throws Error{invalid_argument} if the environment variable LIGHTCUTS_ISA names no instruction set of this machine.
std::unique_ptr<Backend> make_cpu_backend(int threads);

/// The stages on GPU number `device` (src/cuda); only in builds with CUDA. `memory_limit` [bytes], 0: three quarters of
/// what is free. Throws Error{no_device} where it does not answer or this build has no code for it.
std::unique_ptr<Backend> make_cuda_backend(int device, std::uint64_t memory_limit);

/// Builds light trees by the processor, with the builder that the options name (src/cpu); for backends that have no such
/// builder of their own. `scene_diagonal` [m].
LightTrees build_trees_by_cpu(const Lights& lights, float scene_diagonal, const TreeOptions& options,
                              const ProgressFn& progress);

/// How many GPUs answer; 0 in a build without CUDA.
int cuda_device_count() noexcept;

}  // namespace lightcuts
