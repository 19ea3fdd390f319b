#include "cpu/tree/redraw.h"

#include <tbb/parallel_for.h>

#include <utility>

#include "kernels/light_cluster.h"

namespace lightcuts {
namespace {

class Redraw {
 public:
  Redraw(LightTree& tree, std::uint64_t seed, std::vector<LightRange>& ranges)
      : nodes_(tree.nodes), seed_(seed), ranges_(ranges) {
    ranges_.resize(nodes_.size());
  }

  void run() {
    divide();
    // Nodes stand behind their parents, so a sweep from the back finds children done. Blocks of subtrees are apart.
    tbb::parallel_for(std::size_t{0}, blocks_.size(), [&](std::size_t b) {
      for (std::uint32_t k = blocks_[b].end; k-- > blocks_[b].begin;) draw(k);
    });
    for (std::size_t k = upper_nodes_.size(); k-- > 0;) draw(upper_nodes_[k]);
  }

 private:
  struct Block {
    std::uint32_t begin, end;
  };

  /// Leaves the descendants of small enough nodes to blocks.
  void divide() {
    const std::uint32_t limit = max_of(nodes_[0].leaf_count / 64, 256u);
    std::vector<std::uint32_t> pending{0};
    while (!pending.empty()) {
      const std::uint32_t top = pending.back();
      const LightNode& node = nodes_[top];
      pending.pop_back();
      upper_nodes_.push_back(top);
      if (node.is_leaf()) continue;
      if (node.leaf_count <= limit) {
        blocks_.push_back({node.first_child, node.first_child + 2 * (node.leaf_count - 1)});
      } else {
        pending.insert(pending.end(), {node.first_child, node.second_child()});
      }
    }
  }

  void draw(std::uint32_t index) {
    LightNode& node = nodes_[index];
    if (node.is_leaf()) {
      ranges_[index] = {node.representative, node.representative};
      return;
    }
    LightNode &p = nodes_[node.first_child], &q = nodes_[node.second_child()];
    LightRange &of_p = ranges_[node.first_child], &of_q = ranges_[node.second_child()];
    const LightRange range{min_of(of_p.smallest, of_q.smallest), max_of(of_p.largest, of_q.largest)};
    const double random = representative_random(seed_, range.smallest, range.largest, node.leaf_count);
    const bool p_lower = of_p.smallest < of_q.smallest;
    const double light_p = luminance(p.intensity), light_q = luminance(q.intensity);
    const bool lower_wins =
        p_lower ? first_represents(light_p, light_q, random) : first_represents(light_q, light_p, random);
    if (lower_wins != p_lower) {
      std::swap(p, q);
      std::swap(of_p, of_q);
    }
    node.representative = p.representative;
    ranges_[index] = range;
  }

  std::vector<LightNode>& nodes_;
  std::uint64_t seed_;
  std::vector<LightRange>& ranges_;
  std::vector<Block> blocks_;               ///< nodes of subtrees that one thread draws
  std::vector<std::uint32_t> upper_nodes_;  ///< all others, parents first
};

}  // namespace

void redraw_representatives(LightTree& tree, std::uint64_t seed, std::vector<LightRange>& scratch) {
  if (tree.nodes.size() > 1) Redraw(tree, seed, scratch).run();
}

bool DrawPerSample::operator()(std::uint32_t sample) {
  if (!seed_ || sample == drawn_for_) return false;
  constexpr std::uint64_t step = 0x9e3779b97f4a7c15;  // seeds of samples are far from those that people choose
  for (LightTree* tree : {&trees_.vpls, &trees_.points, &trees_.directionals}) {
    redraw_representatives(*tree, *seed_ + sample * step, scratch_);
  }
  drawn_for_ = sample;
  return true;
}

}  // namespace lightcuts
