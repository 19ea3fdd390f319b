#include "lightcuts/render.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "backend/picture_planes.h"
#include "lightcuts/error.h"
#include "render/check_options.h"
#include "render/make_backend.h"
#include "render/memory.h"
#include "render/memory_plan.h"
#include "render/stopwatch.h"

namespace lightcuts {
namespace {

struct Size {
  int width, height;
};

constexpr double kDefaultPixels = 1e6;

/// The size asked for; a side that was left open follows from the other and from the shape that the scene's author or
/// the camera's meant.
Size choose_size(const Scene& scene, const Camera& camera, const RenderOptions& options) {
  if (options.width > 0 && options.height > 0) return {options.width, options.height};
  const bool scene_says = scene.width > 0 && scene.height > 0;
  const double aspect = scene_says          ? static_cast<double>(scene.width) / scene.height
                        : camera.aspect > 0 ? std::clamp(static_cast<double>(camera.aspect), 0.01, 100.0)
                                            : 1.0;
  const auto side = [](double pixels) { return std::clamp(static_cast<int>(std::lround(pixels)), 1, 65536); };
  if (options.width > 0) return {options.width, side(options.width / aspect)};
  if (options.height > 0) return {side(options.height * aspect), options.height};
  if (scene_says) return {scene.width, scene.height};
  return {side(std::sqrt(kDefaultPixels * aspect)), side(std::sqrt(kDefaultPixels / aspect))};
}

template <class Stage>
double timed(Stage stage) {
  const Stopwatch watch;
  stage();
  return watch.ms();
}

std::uint64_t count_emitting_triangles(const Scene& scene) {
  std::uint64_t count = 0;
  for (const Instance& instance : scene.instances) {
    const Mesh& mesh = scene.meshes[instance.mesh];
    if (max_component(scene.materials[mesh.material].emission) > 0) count += mesh.triangles.size();
  }
  return count;
}

/// What an interrupted render returns that never came to its pixels.
Image empty_picture(Size size) {
  Image image = make_rgb_image(size.width, size.height);
  mark_incomplete(image);
  return image;
}

/// Runs the stages and remembers whether the caller asked to stop.
class Run {
 public:
  Run(const Scene& scene, const Camera& camera, const RenderOptions& options, const ProgressFn& progress)
      : scene_(scene), camera_(camera), options_(options), size_(choose_size(scene, camera, options)) {
    if (!progress) return;
    progress_ = [this, &progress](const char* stage, double done) {
      if (!progress(stage, done)) stopped_ = true;
      return !stopped_;
    };
  }

  RenderResult go() {
    const Stopwatch total;
    // A GPU's memory is counted by its backend; the budget given for it is not the host's.
    if (options_.backend != BackendKind::cuda) {
      require_memory(plan_memory(options_, size_.width, size_.height), memory_budget());
    }
    backend_ = make_backend(options_);
    Statistics& s = result_.statistics;
    s.device = backend_->device_name();
    s.scene.triangles = drawn_triangle_count(scene_);
    s.scene.emitters = count_emitting_triangles(scene_);
    s.scene.lights = scene_.point_lights.size() + scene_.directional_lights.size();

    s.time_ms.bvh = timed([&] { backend_->set_scene(scene_, progress_); });
    if (!stopped_ && options_.shade.method != Method::path) make_lights();
    if (stopped_) {
      result_.image = empty_picture(size_);
      result_.complete = false;
    } else {
      s.time_ms.shade = timed([&] { shade(); }) - s.time_ms.shadow_maps;
    }
    s.memory_bytes.host_peak = peak_memory_bytes();
    s.time_ms.total = total.ms();
    return std::move(result_);
  }

 private:
  [[nodiscard]] std::uint64_t memory_budget() const {
    return options_.memory_bytes > 0 ? options_.memory_bytes : default_memory_budget();
  }

  void make_lights() {
    Statistics& s = result_.statistics;
    VplOptions vpls = options_.vpls;
    if (vpls.placement == VplPlacement::camera) {
      vpls.view = PlacementView{camera_, size_.width, size_.height, options_.shade.min_distance};
    }
    s.time_ms.vpls = timed([&] { backend_->trace_vpls(vpls, progress_); });
    if (stopped_) return;
    const Lights& lights = backend_->lights();
    s.vpls.count = lights.vpls.size() + lights.sky_count;
    s.vpls.primary = lights.primary_count + lights.sky_count;
    s.vpls.paths = lights.path_count;
    warn_of_count();

    if (options_.shade.method != Method::lightcuts) return;
    s.time_ms.tree = timed([&] { backend_->build_light_tree(options_.tree, progress_); });
    if (stopped_) return;
    for (const LightTree* tree : trees(backend_->light_trees())) {
      s.tree.nodes += tree->nodes.size();
      s.tree.depth = std::max<std::uint64_t>(s.tree.depth, tree->depth);
    }
  }

  static std::array<const LightTree*, 3> trees(const LightTrees& t) { return {&t.vpls, &t.points, &t.directionals}; }

  /// The number of VPLs is met within 5 %, unless the scene's light cannot be made into so many.
  void warn_of_count() {
    const VplOptions& o = options_.vpls;
    const double wanted = o.primary_lights > 0
                              ? static_cast<double>(o.primary_lights) * static_cast<double>(o.vpls_per_light + 1)
                              : static_cast<double>(o.count);
    const std::uint64_t made = result_.statistics.vpls.count;
    const auto got = static_cast<double>(made);
    if (std::abs(got - wanted) <= 0.05 * wanted + 1) return;
    result_.warnings.push_back(
        fmt::format("There are {} VPLs where {:.0f} were asked for: much of the light leaves the scene or is absorbed, "
                    "or there are too few lights to begin with.",
                    made, wanted));
  }

  void shade() {
    ShadeResult shaded = backend_->shade(camera_, size_.width, size_.height, options_.shade, memory_budget(),
                                         result_.statistics, progress_);
    result_.image = std::move(shaded.image);
    result_.complete = shaded.complete;
  }

  const Scene& scene_;
  const Camera& camera_;
  const RenderOptions& options_;
  Size size_;
  ProgressFn progress_;
  bool stopped_ = false;
  std::unique_ptr<Backend> backend_;
  RenderResult result_;
};

}  // namespace

RenderResult render(const Scene& scene, const Camera& camera, const RenderOptions& options,
                    const ProgressFn& progress) {
  check_options(options);
  if (!emits_light(scene)) {
    throw Error(Code::no_emitter,
                "nothing in the scene emits light; add a light or an emissive material, or light it from outside with "
                "an environment");
  }
  return Run(scene, camera, options, progress).go();
}

}  // namespace lightcuts
