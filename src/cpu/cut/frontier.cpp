#include "cpu/cut/frontier.h"

#include <algorithm>

#include "cpu/cut/cut_light.h"

namespace lightcuts {

Frontier make_frontier(const CutContext& context, std::uint32_t size) {
  Frontier frontier;
  for (const LightKind kind : kLightKinds) {
    const LightTree& tree = tree_of(context.trees, kind);
    if (tree.nodes.empty()) continue;
    const auto dimmer = [&](std::uint32_t a, std::uint32_t b) {
      const auto power = [&](std::uint32_t n) {
        return tree.nodes[n].is_leaf() ? -1.0f : luminance(tree.nodes[n].intensity);
      };
      return power(a) < power(b);
    };
    std::vector<std::uint32_t> heap{0};
    while (heap.size() < size && !tree.nodes[heap.front()].is_leaf()) {
      std::pop_heap(heap.begin(), heap.end(), dimmer);
      const LightNode& brightest = tree.nodes[heap.back()];
      heap.back() = brightest.first_child;
      std::push_heap(heap.begin(), heap.end(), dimmer);
      heap.push_back(brightest.second_child());
      std::push_heap(heap.begin(), heap.end(), dimmer);
    }
    for (const std::uint32_t node : heap) {
      const CutLight light = cut_light(context, kind, node, 0);
      if (is_finite(light.intensity)) frontier.lights[index(kind)].push_back(light);
    }
  }
  return frontier;
}

}  // namespace lightcuts
