#include "cpu/cut/frontier.h"

#include <algorithm>

#include "cpu/cut/cut_light.h"

namespace lightcuts {

namespace {

std::vector<std::uint32_t> brightest_nodes(const LightTree& tree, std::uint32_t size) {
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
  return heap;
}

/// Where a light is, or for a directional one the unit vector to it: what its leaf's box holds.
Vec3 place_of(const LightSet& lights, LightKind kind, std::uint32_t light) {
  switch (kind) {
    case LightKind::vpl:
      return lights.vpls[light].position;
    case LightKind::point:
      return lights.points[light].position;
    case LightKind::directional:
      return -lights.directionals[light].direction;
  }
  return {};
}

}  // namespace

void LightSamples::push_back(Vec3 place) {
  if (count_ == x_.size()) {
    for (std::vector<float>* column : {&x_, &y_, &z_}) column->resize(count_ + kPacketSize);
  }
  x_[count_] = place.x;
  y_[count_] = place.y;
  z_[count_++] = place.z;
}

Frontier make_frontier(const CutContext& context, std::uint32_t size) {
  Frontier frontier;
  for (const LightKind kind : kLightKinds) {
    const LightTree& tree = tree_of(context.trees, kind);
    if (tree.nodes.empty()) continue;
    for (const std::uint32_t node : brightest_nodes(tree, size)) {
      const CutLight light = cut_light(context, kind, node, 0);
      if (is_finite(light.intensity)) frontier.lights[index(kind)].push_back(light);
    }
    LightSamples& samples = kind == LightKind::directional ? frontier.directions : frontier.places;
    for (const std::uint32_t node : brightest_nodes(tree, kLightSamples)) {
      samples.push_back(place_of(context.lights, kind, tree.nodes[node].representative));
    }
  }
  return frontier;
}

}  // namespace lightcuts
