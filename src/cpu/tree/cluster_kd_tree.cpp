#include "cpu/tree/cluster_kd_tree.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace lightcuts {
namespace {

constexpr std::uint32_t kBucketSize = 6;
constexpr std::uint32_t kParallelRange = 4096;
constexpr int kDimensions = 9;

/// Rounding must never make a lower bound exceed the metric: what it may lose, relative and, in cosines, absolute.
constexpr float kShrink = 1 - 8e-6f;
constexpr float kSlack = 2e-6f;

Vec3 as_vector(const Chromaticity& c) { return {c.a, c.b, c.chroma}; }

/// Squared distance of a point to a box.
float distance_sq(Vec3 p, const Box& box) {
  const Vec3 gap = max_of(max_of(box.lo - p, p - box.hi), Vec3{0, 0, 0});
  return dot(gap, gap);
}

/// Lower bound of Walter's metric: the joint box holds what each side surely reaches, the joint cone both axes, so its
/// half angle is at least half of the angle between them, and at least either own half angle.
float walter_lower_bound(const LightCluster& query, float diagonal_sq, float luminance_min, float cosine_max,
                         const Box& axes, float direction_extent_sq, float enough) {
  const float intensity = (query.luminance + luminance_min) * kShrink;
  float spread = 0;
  if (direction_extent_sq > 0 && intensity * diagonal_sq <= enough) {
    const float chord_sq = min_of(distance_sq(query.cone.axis, axes), 4.0f);
    const float cosine = min_of(std::sqrt(1 - 0.25f * chord_sq), min_of(query.cone.cos_half_angle, cosine_max));
    spread = max_of(1 - cosine - kSlack, 0.0f);
  }
  return intensity * (diagonal_sq + direction_extent_sq * spread * spread);
}

/// Lower bound of the colour difference: dC <= dab, so it is at least dab / S_C with the largest chroma there is.
float color_lower_bound(const Chromaticity& query, const Box& colors) {
  const float da = max_of(max_of(colors.lo.x - query.a, query.a - colors.hi.x), 0.0f);
  const float db = max_of(max_of(colors.lo.y - query.b, query.b - colors.hi.y), 0.0f);
  const float s_c = 1 + 0.0225f * (query.chroma + colors.hi.z);
  const float difference = std::sqrt(da * da + db * db) / (s_c * kLargestColourDifference);
  return max_of(min_of(difference * kShrink, 1.0f) - kSlack, 0.0f);
}

}  // namespace

ClusterKdTree::ClusterKdTree(const MetricScale& scale, std::uint32_t id_limit)
    : scale_(scale),
      uses_axes_(scale.metric == Metric::walter
                     ? scale.direction_extent_sq > 0
                     : scale.metric == Metric::distance_direction || scale.metric == Metric::distance_color_direction),
      uses_colors_(scale.metric == Metric::distance_color || scale.metric == Metric::distance_color_direction),
      slot_of_(id_limit, kNoSlot) {}

inline float ClusterKdTree::lower_bound(const LightCluster& query, const Bounds& bounds, float enough) const {
  const Vec3 extent = max_of(query.box.hi, bounds.hi_min) - min_of(query.box.lo, bounds.lo_max);
  const float diagonal_sq = dot(extent, extent);
  if (scale_.metric == Metric::walter) {
    return walter_lower_bound(query, diagonal_sq, bounds.luminance_min, bounds.cosine_max, bounds.axes,
                              scale_.direction_extent_sq, enough);
  }
  float sum = std::sqrt(diagonal_sq) * scale_.inverse_extent * kShrink;
  if (uses_colors_) sum += color_lower_bound(query.color, bounds.colors);
  if (uses_axes_) sum += max_of(0.25f * distance_sq(query.cone.axis, bounds.axes) * kShrink - kSlack, 0.0f);
  return sum * term_weight(scale_.metric) * kShrink;
}

ClusterKdTree::Bounds ClusterKdTree::empty_bounds() {
  constexpr float inf = std::numeric_limits<float>::infinity();
  Bounds bounds;
  bounds.hi_min = {inf, inf, inf};
  bounds.lo_max = {-inf, -inf, -inf};
  bounds.luminance_min = inf;
  return bounds;
}

void ClusterKdTree::extend_bounds(Bounds& bounds, const Bounds& other) {
  bounds.hi_min = min_of(bounds.hi_min, other.hi_min);
  bounds.lo_max = max_of(bounds.lo_max, other.lo_max);
  bounds.axes = extend(bounds.axes, other.axes);
  bounds.colors = extend(bounds.colors, other.colors);
  bounds.luminance_min = min_of(bounds.luminance_min, other.luminance_min);
  bounds.cosine_max = max_of(bounds.cosine_max, other.cosine_max);
  bounds.lowest_id = min_of(bounds.lowest_id, other.lowest_id);
}

ClusterKdTree::Bounds ClusterKdTree::bounds_of(const Bucket& bucket) const {
  Bounds bounds = empty_bounds();
  for (std::uint32_t slot = bucket.begin; slot < bucket.begin + bucket.live; ++slot) {
    const LightCluster& c = clusters_[slot];
    const Vec3 color = as_vector(c.color);
    extend_bounds(bounds, {c.box.hi,
                           c.box.lo,
                           {c.cone.axis, c.cone.axis},
                           {color, color},
                           c.luminance,
                           c.cone.cos_half_angle,
                           ids_[slot]});
  }
  return bounds;
}

int ClusterKdTree::widest_dimension(const std::vector<std::uint32_t>& order, const std::vector<LightCluster>& source,
                                    std::uint32_t begin, std::uint32_t end) const {
  Box positions, axes, colors;
  for (std::uint32_t i = begin; i < end; ++i) {
    const LightCluster& c = source[order[i]];
    positions = extend(positions, center(c.box));
    axes = extend(axes, c.cone.axis);
    colors = extend(colors, as_vector(c.color));
  }
  // Lengths that weigh in the metric about as much as a length in space.
  const float extent = 1 / scale_.inverse_extent;
  const float axis_length = uses_axes_ ? 0.25f * extent : 0.0f;
  const float color_length = uses_colors_ ? extent / kLargestColourDifference * 0.5f : 0.0f;
  int widest = 0;
  float largest = -1;
  for (int d = 0; d < kDimensions; ++d) {
    const Box& box = d < 3 ? positions : d < 6 ? axes : colors;
    const float unit = d < 3 ? 1.0f : d < 6 ? axis_length : color_length;
    const float width = component(box.hi - box.lo, d % 3) * unit;
    if (width > largest) largest = width, widest = d;
  }
  return widest;
}

void ClusterKdTree::build_node(std::uint32_t node, std::uint32_t begin, std::uint32_t end,
                               std::vector<std::uint32_t>& order, const std::vector<LightCluster>& source) {
  if (node >= first_bucket_) {
    buckets_[node - first_bucket_] = {begin, end - begin};
    return;
  }
  const std::uint32_t middle = begin + (end - begin) / 2;
  if (end - begin > 1) {
    const int dimension = widest_dimension(order, source, begin, end);
    const auto key = [&](std::uint32_t i) {
      const LightCluster& c = source[i];
      const Vec3 v = dimension < 3 ? center(c.box) : dimension < 6 ? c.cone.axis : as_vector(c.color);
      return component(v, dimension % 3);
    };
    std::nth_element(order.begin() + begin, order.begin() + middle, order.begin() + end,
                     [&](std::uint32_t a, std::uint32_t b) {
                       const float ka = key(a), kb = key(b);
                       return ka < kb || (ka == kb && a < b);
                     });
  }
  const auto build_left = [&] { build_node(2 * node + 1, begin, middle, order, source); };
  const auto build_right = [&] { build_node(2 * node + 2, middle, end, order, source); };
  if (end - begin > kParallelRange) {
    tbb::parallel_invoke(build_left, build_right);
  } else {
    build_left();
    build_right();
  }
}

void ClusterKdTree::build(std::vector<LightCluster> clusters, std::vector<std::uint32_t> ids) {
  const auto n = static_cast<std::uint32_t>(clusters.size());
  std::uint32_t bucket_count = 1;
  while (bucket_count * static_cast<std::uint64_t>(kBucketSize) < n) bucket_count *= 2;
  first_bucket_ = bucket_count - 1;
  buckets_.assign(bucket_count, {});
  bounds_.assign(first_bucket_ + bucket_count, empty_bounds());
  live_count_ = n;

  // Split, then lay the clusters out in the tree's order.
  std::vector<std::uint32_t> order(n);
  std::iota(order.begin(), order.end(), 0u);
  build_node(0, 0, n, order, clusters);
  clusters_.resize(n);
  ids_.resize(n);
  bucket_of_.resize(n);
  using Range = tbb::blocked_range<std::uint32_t>;
  tbb::parallel_for(Range(0, bucket_count, 512), [&](const Range& range) {
    for (std::uint32_t b = range.begin(); b < range.end(); ++b) {
      for (std::uint32_t slot = buckets_[b].begin; slot < buckets_[b].begin + buckets_[b].live; ++slot) {
        clusters_[slot] = clusters[order[slot]];
        ids_[slot] = ids[order[slot]];
        bucket_of_[slot] = b;
        slot_of_[ids_[slot]] = slot;
      }
      bounds_[first_bucket_ + b] = bounds_of(buckets_[b]);
    }
  });
  for (std::uint32_t node = first_bucket_; node-- > 0;) refit(node);
}

void ClusterKdTree::refit(std::uint32_t node) {
  bounds_[node] = bounds_[2 * node + 1];
  extend_bounds(bounds_[node], bounds_[2 * node + 2]);
}

void ClusterKdTree::refit_above(std::uint32_t bucket) {
  std::uint32_t node = first_bucket_ + bucket;
  bounds_[node] = bounds_of(buckets_[bucket]);
  while (node > 0) {
    node = (node - 1) / 2;
    refit(node);
  }
}

Partner ClusterKdTree::best_partner(std::uint32_t id) const {
  struct Pending {
    float bound;
    std::uint32_t node;
  };
  const std::uint32_t own_slot = slot_of_[id];
  const LightCluster& query = clusters_[own_slot];
  Partner best;
  const auto scan = [&](const Bucket& bucket) {
    for (std::uint32_t slot = bucket.begin; slot < bucket.begin + bucket.live; ++slot) {
      if (slot == own_slot) continue;
      const float size = cluster_size(query, clusters_[slot], scale_);
      if (size < best.size || (size == best.size && ids_[slot] < best.id)) best = {size, ids_[slot]};
    }
  };
  const auto hopeless = [&](float bound, std::uint32_t node) {
    return bound > best.size || (bound == best.size && bounds_[node].lowest_id >= best.id) ||
           bounds_[node].lowest_id == kNoSlot;
  };

  // The own bucket first gives a size to prune with.
  const std::uint32_t own_node = first_bucket_ + bucket_of_[own_slot];
  scan(buckets_[bucket_of_[own_slot]]);
  std::array<Pending, 64> stack;
  std::size_t depth = 0;
  stack[depth++] = {0, 0};
  while (depth > 0) {
    const Pending top = stack[--depth];
    if (hopeless(top.bound, top.node) || top.node == own_node) continue;
    if (top.node >= first_bucket_) {
      scan(buckets_[top.node - first_bucket_]);
      continue;
    }
    Pending near{lower_bound(query, bounds_[2 * top.node + 1], best.size), 2 * top.node + 1};
    Pending far{lower_bound(query, bounds_[2 * top.node + 2], best.size), 2 * top.node + 2};
    if (far.bound < near.bound ||
        (far.bound == near.bound && bounds_[far.node].lowest_id < bounds_[near.node].lowest_id))
      std::swap(near, far);
    if (!hopeless(far.bound, far.node)) stack[depth++] = far;
    if (!hopeless(near.bound, near.node)) stack[depth++] = near;
  }
  return best;
}

void ClusterKdTree::merge(std::uint32_t p, std::uint32_t q, std::uint32_t merged_id, const LightCluster& merged) {
  const std::uint32_t kept = slot_of_[p], dropped = slot_of_[q];
  clusters_[kept] = merged;
  ids_[kept] = merged_id;
  slot_of_[merged_id] = kept;
  slot_of_[p] = slot_of_[q] = kNoSlot;
  --live_count_;

  // Close the gap in the other's bucket with its last live cluster.
  Bucket& bucket = buckets_[bucket_of_[dropped]];
  const std::uint32_t last = bucket.begin + --bucket.live;
  if (dropped != last) {
    clusters_[dropped] = clusters_[last];
    ids_[dropped] = ids_[last];
    slot_of_[ids_[dropped]] = dropped;
  }
  refit_above(bucket_of_[dropped]);
  if (bucket_of_[kept] != bucket_of_[dropped]) refit_above(bucket_of_[kept]);
}

void ClusterKdTree::take_live(std::vector<LightCluster>& clusters, std::vector<std::uint32_t>& ids) const {
  clusters.clear();
  ids.clear();
  for (const Bucket& bucket : buckets_) {
    for (std::uint32_t slot = bucket.begin; slot < bucket.begin + bucket.live; ++slot) {
      clusters.push_back(clusters_[slot]);
      ids.push_back(ids_[slot]);
    }
  }
}

}  // namespace lightcuts
