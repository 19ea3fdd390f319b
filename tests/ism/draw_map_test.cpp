#include "kernels/draw_map.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "ism/map_scene.h"

namespace lightcuts {
namespace {

/// Draws a map a texel at a time by the text that a GPU's threads run.
template <bool Paraboloid>
std::vector<std::uint32_t> draw_by_texels(const SurfacePoints& points, const MapView& view, std::uint32_t stream,
                                          int size) {
  const PointArrays& arrays = points.arrays();
  const auto all = static_cast<std::uint32_t>(points.size());
  const std::uint32_t count = std::min(points.options().per_map, all);
  const float steps = kDepthSteps<std::uint16_t> / view.far;
  std::vector<std::uint32_t> codes(static_cast<std::size_t>(size * size), kNoDepth<std::uint16_t>);
  for (std::uint32_t k = 0; k < count; ++k) {
    const std::uint32_t i = (block_start(stream, all) + k) % all;
    const DiscShape& shape = arrays.shapes[arrays.shape[i]];
    const Vec3 local = to_local_point(view, points.position(i));
    if (!map_sees<Paraboloid>(view, local, arrays.shapes[0].radius)) continue;
    const ProjectedDisc disc = project_disc<Paraboloid>(
        view, local, points.normal(i), shape.radius, pack_sink(arrays.sink_in_front[i], arrays.sink_behind[i]), size);
    const LocalEdges edges = to_local(shape, view);
    for (int y = disc.rows.lo; y <= disc.rows.hi; ++y) {
      for (int x = disc.columns.lo; x <= disc.columns.hi; ++x) {
        const float depth =
            disc_depth<Paraboloid>(view, disc, shape.radius * shape.radius, arrays.shape[i] > 1 ? &edges : nullptr,
                                   texel_centre(x, size), texel_centre(y, size));
        if (!(depth < kInfinity)) continue;
        std::uint32_t& code = codes[static_cast<std::size_t>(y * size + x)];
        code = std::min<std::uint32_t>(code, encode_depth<std::uint16_t>(depth, steps));
      }
    }
  }
  return codes;
}

/// Share of the texels in which two maps differ by more than one code.
double share_of_other_texels(const std::vector<std::uint32_t>& a, const std::vector<std::uint32_t>& b) {
  std::size_t differ = 0;
  for (std::size_t i = 0; i < a.size(); ++i) differ += a[i] > b[i] + 1 || b[i] > a[i] + 1 ? 1 : 0;
  return static_cast<double>(differ) / static_cast<double>(a.size());
}

TEST(DrawMap, TexelByTexelGivesTheLanesMap) {
  MapScene scene(make_builtin_scene("interior"));
  scene.trace(60);
  Lights lights = scene.lights;
  PointLight point;
  point.position = center(scene_bounds(scene.scene));
  point.intensity = {1, 1, 1};
  lights.points = {point};
  lights.directionals = {{normalize(Vec3{0.3f, -1, 0.2f}), {1, 1, 1}}};
  scene.set(lights);
  ShadowMapOptions options;
  options.size = 32;
  options.levels = 0;
  const Maps maps(scene, 2000, options, every_light(scene.light_set));
  const std::uint32_t seed = map_seed(options.seed);
  double worst = 0, drawn = 0;
  for (std::uint32_t i = 0; i < scene.lights.vpls.size(); ++i) {
    const Vpl& vpl = scene.lights.vpls[i];
    const MapView view = vpl_map_view(vpl.position, vpl.axis, maps.points.bounds());
    const auto a = draw_by_texels<true>(maps.points, view, map_stream(i, 0, seed), options.size);
    worst = std::max(worst, share_of_other_texels(a, maps.set.codes_of(LightKind::vpl, i)));
    drawn += share_of_other_texels(a, std::vector<std::uint32_t>(a.size(), kNoDepth<std::uint16_t>));
  }
  EXPECT_GT(drawn / static_cast<double>(scene.lights.vpls.size()), 0.2);
  for (int which = 0; which < 2; ++which) {
    const MapView view = maps.set.view_of(LightKind::point, 0, which);
    worst = std::max(
        worst, share_of_other_texels(draw_by_texels<true>(maps.points, view, map_stream(0, 1, seed), options.size),
                                     maps.set.codes_of(LightKind::point, 0, which)));
  }
  const MapView view = maps.set.view_of(LightKind::directional, 0);
  worst = std::max(worst,
                   share_of_other_texels(draw_by_texels<false>(maps.points, view, map_stream(0, 2, seed), options.size),
                                         maps.set.codes_of(LightKind::directional, 0)));
  std::printf("  at worst %.4f %% of a map's texels differ by more than one code\n", 100 * worst);
  EXPECT_LT(worst, 0.005);  // where a texel's ray just misses a disc, or just not
}

}  // namespace
}  // namespace lightcuts
