#include "lightcuts/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "backend/picture_planes.h"
#include "lightcuts/error.h"
#include "render/check_options.h"
#include "render/make_backend.h"
#include "render/memory.h"
#include "render/memory_plan.h"
#include "render/same_options.h"
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

void require_emitter(const Scene& scene) {
  if (emits_light(scene)) return;
  throw Error(Code::no_emitter,
              "nothing in the scene emits light; add a light or an emissive material, or light it from outside with "
              "an environment");
}

}  // namespace

/// What is there of the pictures before; the backend has it.
class Renderer::State {
 public:
  State(const Scene& scene, const RenderOptions& options) : scene_(&scene) {
    set_options(options);
    require_emitter(scene);
  }

  void set_options(const RenderOptions& options) {
    check_options(options);
    options_ = options;
  }

  void lights_changed() {
    require_emitter(*scene_);
    has_lights_ = has_trees_ = false;
    relit_ = true;
  }

  void scene_changed() {
    require_emitter(*scene_);
    has_scene_ = has_lights_ = has_trees_ = relit_ = false;
  }

  [[nodiscard]] StageRuns runs() const {
    StageRuns runs = earlier_runs_;
    add_runs(runs);
    return runs;
  }

  RenderResult render(const Camera& camera, const ProgressFn& progress) {
    try {
      return render_now(camera, progress);
    } catch (...) {
      close();
      throw;
    }
  }

 private:
  /// One picture under way.
  struct Picture {
    const Camera& camera;
    Size size;
    ProgressFn progress;
    bool stopped = false;
    RenderResult result;
  };

  RenderResult render_now(const Camera& camera, const ProgressFn& progress) {
    const Stopwatch total;
    check_camera(camera);
    Picture picture{camera, choose_size(*scene_, camera, options_), {}, false, {}};
    if (progress) {
      picture.progress = [&picture, &progress](const char* stage, double done) {
        if (!progress(stage, done)) picture.stopped = true;
        return !picture.stopped;
      };
    }
    open(picture.size);
    describe(picture.result.statistics);
    make_scene(picture);
    if (!picture.stopped && options_.shade.method != Method::path) make_lights(picture);
    if (!picture.stopped && options_.shade.method == Method::lightcuts) make_trees(picture);
    Statistics& s = picture.result.statistics;
    if (picture.stopped) {
      picture.result.image = empty_picture(picture.size);
      picture.result.complete = false;
    } else {
      s.time_ms.shade = timed([&] { shade(picture); }) - s.time_ms.shadow_maps;
    }
    s.memory_bytes.host_peak = peak_memory_bytes();
    s.time_ms.total = total.ms();
    return std::move(picture.result);
  }

  // --- Stages; each is run where what it made is not there, or not of what is wanted now ---

  void open(Size size) {
    // A GPU's memory is counted by its backend; the budget given for it is not the host's.
    const MemoryPlan plan = plan_memory(options_, size.width, size.height);
    if (options_.backend != BackendKind::cuda) require_memory(plan, memory_budget());
    if (backend_ != nullptr && same_backend(options_, opened_with_)) {
      const std::uint64_t budget = memory_budget();
      const bool fits = budget == 0 || plan.peak() + backend_->kept_bytes() <= budget;
      if (!backend_->has_own_memory() && !fits) backend_->forget_maps();
      return;
    }
    close();
    backend_ = make_backend(options_);
    opened_with_ = options_;
  }

  void close() {
    add_runs(earlier_runs_);
    backend_.reset();
    has_scene_ = has_lights_ = has_trees_ = relit_ = false;
  }

  void describe(Statistics& s) const {
    s.device = backend_->device_name();
    s.scene.triangles = drawn_triangle_count(*scene_);
    s.scene.emitters = count_emitting_triangles(*scene_);
    s.scene.lights = scene_->point_lights.size() + scene_->directional_lights.size();
  }

  void make_scene(Picture& picture) {
    if (has_scene_ && relit_) backend_->scene_relit();
    relit_ = false;
    if (has_scene_) return;
    has_lights_ = has_trees_ = false;
    picture.result.statistics.time_ms.bvh = timed([&] { backend_->set_scene(*scene_, picture.progress); });
    has_scene_ = !picture.stopped;
  }

  void make_lights(Picture& picture) {
    Statistics& s = picture.result.statistics;
    VplOptions vpls = options_.vpls;
    if (vpls.placement == VplPlacement::camera) {
      vpls.view = PlacementView{picture.camera, picture.size.width, picture.size.height, options_.shade.min_distance};
    }
    if (!has_lights_ || !same_vpls(vpls, traced_with_)) {
      has_lights_ = has_trees_ = false;
      s.time_ms.vpls = timed([&] { backend_->trace_vpls(vpls, picture.progress); });
      if (picture.stopped) return;
      has_lights_ = true;
      traced_with_ = vpls;
    }
    const LightCounts lights = backend_->light_counts();
    s.vpls.count = lights.vpls + lights.sky;
    s.vpls.primary = lights.primary + lights.sky;
    s.vpls.paths = lights.paths;
    warn_of_count(picture.result);
  }

  void make_trees(Picture& picture) {
    Statistics& s = picture.result.statistics;
    if (!has_trees_ || !same_trees(options_.tree, built_with_)) {
      has_trees_ = false;
      s.time_ms.tree = timed([&] { backend_->build_light_tree(options_.tree, picture.progress); });
      if (picture.stopped) return;
      has_trees_ = true;
      built_with_ = options_.tree;
    }
    const TreeCounts trees = backend_->tree_counts();
    s.tree.nodes = trees.nodes;
    s.tree.depth = trees.depth;
  }

  void shade(Picture& picture) {
    const std::uint64_t budget = backend_->has_own_memory() ? options_.memory_bytes : memory_budget();
    ShadeResult shaded = backend_->shade(picture.camera, picture.size.width, picture.size.height, options_.shade,
                                         budget, picture.result.statistics, picture.progress);
    picture.result.image = std::move(shaded.image);
    picture.result.complete = shaded.complete;
  }

  [[nodiscard]] std::uint64_t memory_budget() const {
    if (options_.memory_bytes > 0) return options_.memory_bytes;
    // What is kept for this picture is not free, but serves it.
    const std::uint64_t free = default_memory_budget();
    return free == 0 || backend_ == nullptr ? free : free + backend_->kept_bytes();
  }

  /// The number of VPLs is met within 5 %, unless the scene's light cannot be made into so many.
  void warn_of_count(RenderResult& result) const {
    const VplOptions& o = options_.vpls;
    const double wanted = o.primary_lights > 0
                              ? static_cast<double>(o.primary_lights) * static_cast<double>(o.vpls_per_light + 1)
                              : static_cast<double>(o.count);
    const std::uint64_t made = result.statistics.vpls.count;
    const auto got = static_cast<double>(made);
    if (std::abs(got - wanted) <= 0.05 * wanted + 1) return;
    const char* why = got < wanted
                          ? "much of the light leaves the scene or is absorbed, or there are too few lights to "
                            "begin with"
                      : o.primary_lights > 0
                          ? "each light shoots as many paths as were asked for, and they leave a VPL at every bounce "
                            "(with --bounces 1, at one)"
                          : "light paths here leave more VPLs than the pilot's did";
    result.warnings.push_back(fmt::format("There are {} VPLs where {:.0f} were asked for: {}.", made, wanted, why));
  }

  void add_runs(StageRuns& runs) const {
    if (backend_ == nullptr) return;
    const StageCounts counts = backend_->stage_counts();
    runs.acceleration_structures += counts.scenes;
    runs.vpls += counts.vpls;
    runs.light_trees += counts.trees;
    runs.surface_points += counts.points;
    runs.shadow_maps += counts.maps;
    runs.pictures += counts.pictures;
  }

  const Scene* scene_;
  RenderOptions options_;
  std::unique_ptr<Backend> backend_;
  RenderOptions opened_with_;
  VplOptions traced_with_;
  TreeOptions built_with_;
  bool has_scene_ = false, has_lights_ = false, has_trees_ = false;
  bool relit_ = false;  ///< the scene's lights have changed since the backend saw them
  StageRuns earlier_runs_;
};

Renderer::Renderer(const Scene& scene, const RenderOptions& options)
    : state_(std::make_unique<State>(scene, options)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

void Renderer::set_options(const RenderOptions& options) { state_->set_options(options); }
void Renderer::lights_changed() { state_->lights_changed(); }
void Renderer::scene_changed() { state_->scene_changed(); }
RenderResult Renderer::render(const Camera& camera, const ProgressFn& progress) {
  return state_->render(camera, progress);
}
StageRuns Renderer::runs() const { return state_->runs(); }

}  // namespace lightcuts
