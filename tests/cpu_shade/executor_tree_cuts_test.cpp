#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>

#include "backend/build_light_tree.h"
#include "backend/scene_arrays.h"
#include "kernels/serial_executor.h"
#include "lightcuts/render.h"
#include "lightcuts/scene.h"
#include "lit_backend.h"

namespace lightcuts {
namespace {

/// The tree that a GPU builds, by the serial executor.
LightTree by_executor(const std::vector<Vpl>& lights, float diagonal) {
  SerialExecutor exec;
  LightTreeBuild options;
  options.scale = {Metric::walter, 1 / diagonal, diagonal * diagonal};
  options.seed = 1;
  const auto built = build_light_tree(exec, lights.data(), static_cast<std::uint32_t>(lights.size()), options);
  LightTree tree;
  tree.depth = built.depth;
  tree.nodes.assign(built.nodes(), built.nodes() + built.node_count());
  return tree;
}

class ExecutorTreeCuts : public testing::TestWithParam<const char*> {};

TEST_P(ExecutorTreeCuts, AreAsLargeAsOverTheCpusTree) {
  LitBackend lit(make_builtin_scene(GetParam()), 50000);
  const float diagonal = SceneArrays(lit.scene).view().diagonal;
  const Camera camera = select_camera(lit.scene, "");
  ShadeOptions options;
  options.method = Method::lightcuts;
  options.visibility = Visibility::none;
  double mean[2];
  for (const bool by_gpu : {false, true}) {
    if (by_gpu) {
      LightTrees trees = lit.backend.light_trees();
      trees.vpls = by_executor(lit.backend.lights().vpls, diagonal);
      lit.backend.set_light_tree(std::move(trees));
    }
    options.cut = CutWalk::heap;  // packets guess a total, too
    lit.shade(camera, 80, 60, options);
    mean[by_gpu ? 1 : 0] = lit.statistics.cut.mean;
  }
  std::printf("  %s: mean cut %.1f over the GPU's tree, %.1f over the CPU's\n", GetParam(), mean[1], mean[0]);
  EXPECT_LT(mean[1], 1.03 * mean[0]);
}
INSTANTIATE_TEST_SUITE_P(Scenes, ExecutorTreeCuts, testing::Values("cornell", "study", "interior", "lamps?count=100"));

}  // namespace
}  // namespace lightcuts
