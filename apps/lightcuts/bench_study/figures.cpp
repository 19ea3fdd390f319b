// Figure 1: a light tree and a cut through it. Figures 2 and 3: one shadow map before and after pull-push.

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "backend/emitter_table.h"
#include "bench_study/cpu_maps.h"
#include "bench_study/rooms.h"
#include "bench_study/study.h"
#include "cpu/cut/pixel_cut.h"
#include "cpu/tile.h"
#include "kernels/pull_push.h"
#include "lightcuts/io.h"

namespace lightcuts::app::study {
namespace {

using Codes = std::vector<std::uint16_t>;
constexpr std::uint16_t kHole = kNoDepth<std::uint16_t>;

/// A square of depth codes.
struct Square {
  Codes codes;
  int side;
  [[nodiscard]] std::uint16_t at(int x, int y) const {
    return x < 0 || y < 0 || x >= side || y >= side ? kHole : codes[static_cast<std::size_t>(y * side + x)];
  }
};

/// The study's pull: the mean of the valid ones of four.
Square pulled(const Square& fine) {
  const FillRule rule = fill_rule<std::uint16_t>(false, 0);
  Square coarse{Codes(fine.codes.size() / 4), fine.side / 2};
  for (int y = 0; y < coarse.side; ++y) {
    for (int x = 0; x < coarse.side; ++x) {
      coarse.codes[static_cast<std::size_t>(y * coarse.side + x)] =
          pull_texel(fine.at(2 * x, 2 * y), fine.at(2 * x + 1, 2 * y), fine.at(2 * x, 2 * y + 1),
                     fine.at(2 * x + 1, 2 * y + 1), rule.threshold, rule.least);
    }
  }
  return coarse;
}

Square cropped(const Square& from, int x0, int y0, int side) {
  Square out{{}, side};
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) out.codes.push_back(from.at(x0 + x, y0 + y));
  }
  return out;
}

/// Writes a map, each texel so many pixels large, holes grey.
void save_map(const std::filesystem::path& path, const Square& map, int pixels, float low, float high) {
  const int scale = pixels / map.side, side = map.side * scale;
  std::vector<float> values;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const std::uint16_t code = map.at(x / scale, y / scale);
      values.push_back(code == kHole ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(code));
    }
  }
  save_png(path, false_colour(side, side, values, low, high).picture);
}

std::size_t holes(const Square& map) {
  return static_cast<std::size_t>(std::count(map.codes.begin(), map.codes.end(), kHole));
}

void draw_maps(Study& study) {
  const CpuMaps maps(11);
  const std::size_t light = maps.lights().primary_count + 40;
  const auto map = [&](const PointOptions& points, int levels, HoleFill fill) {
    return Square{maps.make(light, 1, points, levels, fill).front(), kStudyMapSide};
  };
  const Square before = map(kStudyPoints, 0, HoleFill::mean), after = map(kStudyPoints, 2, HoleFill::mean);
  const Square ours = map({}, 2, HoleFill::edges);
  study.set(
      "map_holes",
      {{"before", holes(before)}, {"after", holes(after)}, {"ours", holes(ours)}, {"texels", before.codes.size()}});
  if (study.folder().empty()) return;

  std::uint16_t low = kHole, high = 0;
  for (const Square* s : {&before, &after, &ours}) {
    for (const std::uint16_t c : s->codes) {
      if (c == kHole) continue;
      low = std::min(low, c);
      high = std::max(high, c);
    }
  }
  const auto save = [&](const char* name, const Square& square, const char* caption) {
    const std::string file = fmt::format("pictures/{}.png", name);
    save_map(study.folder() / file, square, 512, low, high);
    study.add(Picture{name, file, caption});
  };
  save("map-before", before, "points drawn, holes grey");
  save("map-after", after, "the study's pull-push, two levels");
  save("map-ours", ours, "ours: discs instead of points");
  constexpr int x0 = 56, y0 = 56, side = 16;
  const Square crop = cropped(before, x0, y0, side);
  save("hole-0", crop, "before");
  save("hole-1", pulled(crop), "pulled once");
  save("hole-2", pulled(pulled(crop)), "pulled twice");
  save("hole-3", cropped(after, x0, y0, side), "pushed back");
}

Json box_json(const Box& box) { return {box.lo.x, box.lo.z, box.hi.x, box.hi.z}; }

/// A small tree and the cut that the picture's middle pixel makes in it.
void draw_tree(Study& study) {
  const std::unique_ptr<Backend> backend = make_cpu_backend(1);
  const Scene& room = study_room();
  backend->set_scene(room, {});
  backend->trace_vpls(study_lights(3), {});
  backend->build_light_tree({TreeBuilder::agglomerative, Metric::walter, 1}, {});
  const LightTrees& trees = backend->light_trees();
  const Lights& lights = backend->lights();

  const SceneArrays arrays(room);
  const RayTracer tracer(arrays.view());
  const EmitterTable emitters(arrays);
  const LightSet set = make_light_set(lights);
  LightMarks marks(trees);
  const RayVisibility rays(tracer);
  const float clamp = 0.01f * arrays.view().diagonal;
  const CutContext context{trees, set, &rays, clamp * clamp, 0.1f, 0, marks};
  const View view = make_view(room.cameras[0], 64, 64, 1, 1, true);
  const Tile tile = trace_tile(view, 32, 48, 0, arrays.view(), tracer, emitters.view());
  PixelLights pixel(context, tile.packets[0], 0);
  PixelCut cut;
  cut_by_heap(context, pixel, cut);

  Json nodes = Json::array(), points = Json::array();
  for (const LightNode& node : trees.vpls.nodes) {
    nodes.push_back({{"first", node.is_leaf() ? Json(nullptr) : Json(node.first_child)},
                     {"second", node.is_leaf() ? Json(nullptr) : Json(node.second_child())},
                     {"light", node.representative},
                     {"intensity", luminance(node.intensity)},
                     {"box", box_json(node.box)},
                     {"cut", false}});
  }
  for (const CutNode& node : cut.nodes) {
    if (node.kind == LightKind::vpl) nodes[node.node]["cut"] = true;
  }
  for (const Vpl& vpl : lights.vpls) points.push_back({vpl.position.x, vpl.position.z, luminance(vpl.intensity)});
  study.set("tree", {{"nodes", nodes}, {"lights", points}, {"error", 0.1}});
}

}  // namespace

void make_figures(Study& study) {
  draw_tree(study);
  study.show_done(0.5);
  draw_maps(study);
}

}  // namespace lightcuts::app::study
