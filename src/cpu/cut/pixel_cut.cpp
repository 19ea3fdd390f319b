#include "cpu/cut/pixel_cut.h"

#include <algorithm>
#include <cmath>

namespace lightcuts {
namespace {

/// Once the total has shrunk to this share of what was once in it, rounding of subtractions may matter: sum again.
constexpr double kResumShare = 1e-6;

bool finite_intensity(const LightNode& node) { return is_finite(node.intensity); }

class HeapCut {
 public:
  HeapCut(const CutContext& context, PixelLights& lights, PixelCut& cut)
      : context_(context), lights_(lights), cut_(cut), weights_(lights.weights()) {
    cut_.nodes.clear();
  }

  void run() {
    for (const LightKind kind : kLightKinds) {
      const LightTree& tree = tree_of(context_.trees, kind);
      if (!tree.nodes.empty()) add(kind, 0, lights_.evaluate(kind, tree.nodes[0].representative));
    }
    while (!done()) refine();
    finish();
  }

 private:
  // Inner nodes are the heap cut_.nodes, leaves wait in leaves_: they cannot be refined and never leave the sum.
  static bool less(const CutNode& a, const CutNode& b) { return a.bound < b.bound; }

  [[nodiscard]] const LightNode& node_of(const CutNode& c) const {
    return tree_of(context_.trees, c.kind).nodes[c.node];
  }

  [[nodiscard]] double luminance_of(const LightNode& node, UnitLight unit) const {
    // A sum of lights of absurd strength has an infinite bound, so it does not stay in the cut: leave it out of the sum.
    if (!finite_intensity(node)) return 0;
    const double x = static_cast<double>(weights_.x) * node.intensity.x;
    const double y = static_cast<double>(weights_.y) * node.intensity.y;
    const double z = static_cast<double>(weights_.z) * node.intensity.z;
    return (x + y + z) * unit.clamped;
  }

  void add(LightKind kind, std::uint32_t index, UnitLight unit) {
    const LightNode& node = tree_of(context_.trees, kind).nodes[index];
    const double share = luminance_of(node, unit);
    if (node.is_leaf()) {
      leaves_.push_back({0, index, kind, unit});
      leaf_total_ += share;
      return;
    }
    heap_total_ += share;
    peak_ = std::max(peak_, heap_total_);
    cut_.nodes.push_back({lights_.bound(kind, node), index, kind, unit});
    std::push_heap(cut_.nodes.begin(), cut_.nodes.end(), less);
  }

  void refine() {
    std::pop_heap(cut_.nodes.begin(), cut_.nodes.end(), less);
    const CutNode top = cut_.nodes.back();
    cut_.nodes.pop_back();
    const LightNode& node = node_of(top);
    heap_total_ -= luminance_of(node, top.unit);
    add(top.kind, node.first_child, top.unit);
    const std::uint32_t second = node.second_child();
    add(top.kind, second, lights_.evaluate(top.kind, tree_of(context_.trees, top.kind).nodes[second].representative));
    if (heap_total_ < kResumShare * peak_) sum_again();
  }

  void sum_again() {
    heap_total_ = 0;
    for (const CutNode& c : cut_.nodes) heap_total_ += luminance_of(node_of(c), c.unit);
    peak_ = heap_total_;
  }

  [[nodiscard]] bool done() {
    if (cut_.nodes.empty()) return true;
    if (context_.max_cut > 0 && cut_.nodes.size() + leaves_.size() >= context_.max_cut) return true;
    return cut_.nodes.front().bound <= context_.threshold(heap_total_ + leaf_total_);
  }

  void finish() {
    cut_.largest_bound = cut_.nodes.empty() ? 0 : cut_.nodes.front().bound;
    cut_.nodes.insert(cut_.nodes.end(), leaves_.begin(), leaves_.end());
    cut_.light = {};
    cut_.lost = 0;
    for (const CutNode& c : cut_.nodes) {
      const Vec3 intensity = node_of(c).intensity;
      if (c.unit.clamped > 0) {
        cut_.light += Vec3T<double>{intensity.x, intensity.y, intensity.z} * static_cast<double>(c.unit.clamped);
      }
      cut_.lost += static_cast<double>(luminance(intensity)) * (static_cast<double>(c.unit.unclamped) - c.unit.clamped);
    }
    cut_.total = weights_.x * cut_.light.x + weights_.y * cut_.light.y + weights_.z * cut_.light.z;
  }

  const CutContext& context_;
  PixelLights& lights_;
  PixelCut& cut_;
  Vec3 weights_;
  std::vector<CutNode> leaves_;
  double heap_total_ = 0, leaf_total_ = 0, peak_ = 0;
};

}  // namespace

void cut_by_heap(const CutContext& context, PixelLights& lights, PixelCut& cut) { HeapCut(context, lights, cut).run(); }

}  // namespace lightcuts
