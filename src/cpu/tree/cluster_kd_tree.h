#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "cpu/tree/merge_tree.h"

namespace lightcuts {

/// A cluster's partner and the size of what both would make. Smaller is better; equal sizes go to the lower id.
struct Partner {
  float size = std::numeric_limits<float>::infinity();
  std::uint32_t id = 0xffffffffu;
};

/// Live clusters in a balanced tree whose nodes bound positions, axes, colours and luminances, so that a search for the
/// best partner under any metric can pass over subtrees. Not in a class with nearest points: "near" means small together.
class ClusterKdTree {
 public:
  /// @param id_limit  ids are below it
  ClusterKdTree(const MetricScale& scale, std::uint32_t id_limit);

  /// Starts anew with the given clusters. Positions of ids in the result of `ids_in_order` are coherent in space.
  void build(std::vector<LightCluster> clusters, std::vector<std::uint32_t> ids);

  /// The best partner of a live cluster among all others; id 0xffffffff if there is none. Safe to call in parallel.
  [[nodiscard]] Partner best_partner(std::uint32_t id) const;

  /// Puts `merged` in place of `p` and removes `q`.
  void merge(std::uint32_t p, std::uint32_t q, std::uint32_t merged_id, const LightCluster& merged);

  [[nodiscard]] bool contains(std::uint32_t id) const { return slot_of_[id] != kNoSlot; }
  [[nodiscard]] const LightCluster& cluster(std::uint32_t id) const { return clusters_[slot_of_[id]]; }
  [[nodiscard]] std::uint32_t live_count() const { return live_count_; }
  [[nodiscard]] std::uint32_t built_count() const { return static_cast<std::uint32_t>(clusters_.size()); }

  /// Live clusters and their ids, in the tree's order.
  void take_live(std::vector<LightCluster>& clusters, std::vector<std::uint32_t>& ids) const;

 private:
  static constexpr std::uint32_t kNoSlot = 0xffffffffu;

  /// Bounds of the clusters below a node, and the lowest id among them. Empty: lowest id 0xffffffff.
  struct Bounds {
    Vec3 hi_min, lo_max;  ///< boxes reach at least up to hi_min and at least down to lo_max
    Box axes;             ///< of the cones' axes
    Box colors;           ///< of (a, b, chroma)
    float luminance_min = 0;
    float cosine_max = -1;  ///< of the cones' half angles
    std::uint32_t lowest_id = kNoSlot;
  };
  struct Bucket {
    std::uint32_t begin = 0, live = 0;
  };

  /// Below the size of any union of `query` with a cluster within `bounds`; loose where it is above `enough` anyway.
  [[nodiscard]] float lower_bound(const LightCluster& query, const Bounds& bounds, float enough) const;
  [[nodiscard]] static Bounds empty_bounds();
  static void extend_bounds(Bounds& bounds, const Bounds& other);
  [[nodiscard]] Bounds bounds_of(const Bucket& bucket) const;
  void build_node(std::uint32_t node, std::uint32_t begin, std::uint32_t end, std::vector<std::uint32_t>& order,
                  const std::vector<LightCluster>& source);
  [[nodiscard]] int widest_dimension(const std::vector<std::uint32_t>& order, const std::vector<LightCluster>& source,
                                     std::uint32_t begin, std::uint32_t end) const;
  void refit(std::uint32_t node);
  void refit_above(std::uint32_t bucket);

  MetricScale scale_;
  bool uses_axes_, uses_colors_;
  std::vector<std::uint32_t> slot_of_;    ///< by id
  std::vector<LightCluster> clusters_;    ///< by slot
  std::vector<std::uint32_t> ids_;        ///< by slot
  std::vector<std::uint32_t> bucket_of_;  ///< by slot
  std::vector<Bounds> bounds_;            ///< by node; children of k are 2k + 1 and 2k + 2, buckets come last
  std::vector<Bucket> buckets_;
  std::uint32_t first_bucket_ = 0;  ///< node of bucket 0
  std::uint32_t live_count_ = 0;
};

}  // namespace lightcuts
