#include "bench_study/scalar_gold.h"

#include <tbb/task_arena.h>

#include "backend/emitter_table.h"
#include "backend/scene_arrays.h"
#include "cpu/cut/pixel_lights.h"
#include "cpu/progress.h"
#include "cpu/ray_tracer.h"
#include "cpu/shade_picture.h"

namespace lightcuts::app::study {
namespace {

Vec3T<double> scaled(Vec3 colour, double factor) { return {colour.x * factor, colour.y * factor, colour.z * factor}; }

class ScalarLighter final : public TileLighter {
 public:
  ScalarLighter(const CutContext& context, const Lights& lights) : context_(context), lights_(lights) {}

  bool light(const Tile& tile, Progress& progress, TileLight& out) const override {
    for (int pixel = 0; pixel < kTilePixels; ++pixel) {
      const SurfacePacket& packet = tile.packets[static_cast<std::size_t>(pixel / kPacketSize)];
      const int lane = pixel % kPacketSize;
      if ((packet.receivers.active >> lane & 1u) != 0) sum(packet, lane, pixel, out);
      if (!progress.advance(1.0 / kTilePixels)) return false;
    }
    return true;
  }

 private:
  void sum(const SurfacePacket& packet, int lane, int pixel, TileLight& out) const {
    PixelLights unit(context_, packet, lane);
    Vec3T<double> light;
    for (std::size_t i = 0; i < lights_.vpls.size(); ++i) {
      light += scaled(lights_.vpls[i].intensity, unit.evaluate(LightKind::vpl, static_cast<std::uint32_t>(i)).clamped);
    }
    out.light[pixel] = light;
    out.pairs += unit.evaluations();
    out.rays += unit.rays();
  }

  const CutContext& context_;
  const Lights& lights_;
};

}  // namespace

struct ScalarRadiosity::Loaded {
  explicit Loaded(const Scene& scene) : arrays(scene), tracer(arrays.view()), emitters(arrays) {}
  SceneArrays arrays;
  RayTracer tracer;
  EmitterTable emitters;
};

ScalarRadiosity::ScalarRadiosity(const Scene& scene) : loaded_(std::make_unique<Loaded>(scene)) {}
ScalarRadiosity::~ScalarRadiosity() = default;

Image ScalarRadiosity::render(const Lights& lights, const Camera& camera, int width, int height,
                              const ProgressFn& callback) const {
  const ShadeOptions defaults;
  const SceneView scene = loaded_->arrays.view();
  const float min_distance = defaults.min_distance * scene.diagonal;
  const LightSet set = make_light_set(lights);
  const LightTrees no_trees;
  LightMarks marks(no_trees);
  const RayVisibility rays(loaded_->tracer);
  const CutContext context{no_trees, set, &rays, min_distance * min_distance, 0, 0, marks};
  const ScalarLighter lighter(context, lights);

  const View view = make_view(camera, width, height, 1, defaults.seed, true);
  Progress progress(callback, "shade", tile_count(view));
  const EmitterView emitters = loaded_->emitters.view();
  const TileSource source{view, scene, loaded_->tracer, emitters};
  Film film(width, height);
  tbb::task_arena one(1);
  one.execute([&] { for_each_tile(view, film, progress, lit_tile(source, lighter, progress)); });
  return film.image(1);
}

}  // namespace lightcuts::app::study
