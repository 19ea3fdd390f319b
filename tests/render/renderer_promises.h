#pragma once

#include <gtest/gtest.h>

#include <string>

#include "lightcuts/renderer.h"

namespace lightcuts::test {

inline void expect_same_pictures(const RenderResult& a, const RenderResult& b, const std::string& what) {
  ASSERT_EQ(a.image.channels.size(), b.image.channels.size()) << what;
  for (std::size_t c = 0; c < a.image.channels.size(); ++c) {
    EXPECT_EQ(a.image.channels[c].values, b.image.channels[c].values) << what << ", " << a.image.channels[c].name;
  }
}

/// Renders a series of pictures and looks at each: to the bit that of a render from nothing, with the stages run that
/// the change asks for.
class RendererSeries {
 public:
  RendererSeries(Scene scene, const RenderOptions& options)
      : scene_(std::move(scene)), options_(options), renderer_(scene_, options) {}

  /// @param vpls, trees  how often the stages are to run for this picture
  void expect(const Camera& camera, const std::string& what, std::uint64_t scenes, std::uint64_t vpls,
              std::uint64_t trees) {
    const StageRuns before = renderer_.runs();
    const RenderResult picture = renderer_.render(camera);
    last_ = renderer_.runs();
    EXPECT_EQ(last_.acceleration_structures - before.acceleration_structures, scenes) << what;
    EXPECT_EQ(last_.vpls - before.vpls, vpls) << what;
    EXPECT_EQ(last_.light_trees - before.light_trees, trees) << what;
    EXPECT_EQ(last_.pictures - before.pictures, 1u) << what;
    maps = last_.shadow_maps - before.shadow_maps;
    points = last_.surface_points - before.surface_points;
    EXPECT_EQ(picture.statistics.time_ms.vpls > 0, vpls > 0) << what;
    expect_same_pictures(picture, render(scene_, camera, options_), what);
  }

  std::uint64_t maps = 0, points = 0;  ///< of the last picture

  Scene& scene() { return scene_; }
  RenderOptions& options() { return options_; }
  Renderer& renderer() { return renderer_; }

 private:
  Scene scene_;
  RenderOptions options_;
  Renderer renderer_;
  StageRuns last_;
};

/// @param small  as a checker wants it; so few VPLs that a change of materials often leaves their number as it was
inline RenderOptions series_options(BackendKind backend, Visibility visibility, bool small = false) {
  RenderOptions options;
  options.backend = backend;
  options.width = small ? 20 : 40;
  options.height = small ? 15 : 30;
  options.vpls.count = small ? 200 : 800;
  options.shade.method = Method::lightcuts;
  options.shade.visibility = visibility;
  options.shade.ism_size = 16;
  options.shade.ism_points = 500;
  return options;
}

inline Camera moved(Camera camera, float by) {
  camera.world_from_camera.origin += camera.world_from_camera.x * by;
  return camera;
}

/// What Renderer's description says is remade, on any backend.
inline void expect_renderer_keeps_what_it_says(Scene scene, const Camera& camera, BackendKind backend,
                                               Visibility visibility, bool small = false) {
  RendererSeries series(std::move(scene), series_options(backend, visibility, small));
  const bool by_maps = visibility == Visibility::ism;
  series.expect(camera, "first", 1, 1, 1);
  const std::uint64_t first_maps = series.maps;
  series.expect(camera, "the same again", 0, 0, 0);
  if (by_maps) {
    EXPECT_GT(first_maps, 0u);
    EXPECT_EQ(series.maps, 0u);
    EXPECT_EQ(series.points, 0u);
  }
  const Camera other = moved(camera, 0.1f);
  series.expect(other, "a moved camera", 0, 0, 0);
  if (by_maps) {
    EXPECT_LT(series.maps, first_maps / 2);
  }
  series.options().width = 33;
  series.renderer().set_options(series.options());
  series.expect(other, "another size", 0, 0, 0);
  series.options().shade.error = 0.05f;
  series.renderer().set_options(series.options());
  series.expect(other, "another error", 0, 0, 0);
  series.options().tree.metric = Metric::distance;
  series.renderer().set_options(series.options());
  series.expect(other, "another metric", 0, 0, 1);
  if (by_maps) {
    EXPECT_LT(series.maps, first_maps);
  }
  // Twice the light: VPLs stand where they stood.
  for (Material& m : series.scene().materials) m.emission = m.emission * 2.0f;
  for (PointLight& p : series.scene().point_lights) p.intensity = p.intensity * 2.0f;
  series.renderer().lights_changed();
  series.expect(other, "brighter lights", 0, 1, 1);
  if (by_maps) {
    EXPECT_LT(series.maps, first_maps / 4);
    EXPECT_EQ(series.points, 0u);
  }
  for (Material& m : series.scene().materials) m.base_color = m.base_color * 0.5f;
  series.renderer().lights_changed();
  series.expect(other, "darker surfaces", 0, 1, 1);
  series.options().vpls.count = 500;
  series.renderer().set_options(series.options());
  series.expect(other, "fewer VPLs", 0, 1, 1);
  series.scene().instances.back().world_from_object.origin += Vec3{0.05f, 0, 0};
  series.renderer().scene_changed();
  series.expect(other, "a moved mesh", 1, 1, 1);
  series.options().shade.method = Method::path;
  series.options().shade.samples = 2;
  series.renderer().set_options(series.options());
  series.expect(other, "paths", 0, 0, 0);
  series.options().shade.method = Method::instant_radiosity;
  series.options().shade.samples = 1;
  series.renderer().set_options(series.options());
  series.expect(other, "all lights", 0, 0, 0);
  series.expect(camera, "all lights, a moved camera", 0, 0, 0);
  if (by_maps) {
    EXPECT_EQ(series.maps, 0u);
  }
}

/// With VPLs placed for the camera they follow it, and only then.
inline void expect_vpls_follow_the_camera(Scene scene, const Camera& camera, BackendKind backend, bool small = false) {
  RenderOptions options = series_options(backend, Visibility::rays, small);
  options.vpls.placement = VplPlacement::camera;
  RendererSeries series(std::move(scene), options);
  series.expect(camera, "first", 1, 1, 1);
  series.expect(camera, "the same again", 0, 0, 0);
  series.expect(moved(camera, 0.1f), "a moved camera", 0, 1, 1);
}

/// A picture that was stopped, or failed, does no harm to the next one.
inline void expect_renderer_recovers(Scene scene, const Camera& camera, BackendKind backend, bool small = false) {
  RendererSeries series(std::move(scene), series_options(backend, Visibility::ism, small));
  for (const char* stage : {"bvh", "vpls", "tree", "shade"}) {
    const RenderResult stopped =
        series.renderer().render(camera, [stage](const char* now, double) { return std::string(now) != stage; });
    EXPECT_FALSE(stopped.complete) << stage;
  }
  series.options().memory_bytes = 1000;
  series.renderer().set_options(series.options());
  EXPECT_ANY_THROW(series.renderer().render(camera));
  series.options().memory_bytes = 0;
  series.renderer().set_options(series.options());
  series.expect(camera, "after a failure", 1, 1, 1);
}

}  // namespace lightcuts::test
