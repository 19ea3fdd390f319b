#include "cpu/tree/ploc.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <limits>

#include "kernels/ploc_pair.h"

namespace lightcuts {
namespace {

constexpr std::uint32_t kBlock = 256;
constexpr std::uint32_t kWindow = kBlock + 2 * kLargestPlocRadius + 2;

/// A stretch of clusters, one array a quantity, so that the search runs in SIMD lanes.
struct ClusterWindow {
  template <class T>
  using Lane = std::array<T, kWindow>;
  alignas(64) Lane<float> lo_x, lo_y, lo_z, hi_x, hi_y, hi_z, axis_x, axis_y, axis_z, cosine, sine, luminance, a, b,
      chroma;
  alignas(64) Lane<float> up, down;  ///< best ranks

  void load(const LightCluster* clusters, std::uint32_t count) {
    for (std::uint32_t i = 0; i < count; ++i) {
      const LightCluster& c = clusters[i];
      lo_x[i] = c.box.lo.x, lo_y[i] = c.box.lo.y, lo_z[i] = c.box.lo.z;
      hi_x[i] = c.box.hi.x, hi_y[i] = c.box.hi.y, hi_z[i] = c.box.hi.z;
      axis_x[i] = c.cone.axis.x, axis_y[i] = c.cone.axis.y, axis_z[i] = c.cone.axis.z;
      cosine[i] = c.cone.cos_half_angle, sine[i] = detail::sine_of(c.cone.cos_half_angle);
      luminance[i] = c.luminance;
      a[i] = c.color.a, b[i] = c.color.b, chroma[i] = c.color.chroma;
    }
    std::fill_n(up.begin(), count, std::numeric_limits<float>::infinity());
    std::fill_n(down.begin(), count, std::numeric_limits<float>::infinity());
  }

  [[nodiscard]] Vec3 axis(std::uint32_t i) const { return {axis_x[i], axis_y[i], axis_z[i]}; }
  [[nodiscard]] Chromaticity color(std::uint32_t i) const { return {a[i], b[i], chroma[i]}; }
};

/// Size of the union of clusters i and j; the same formulas as `cluster_size`, chosen while compiling.
template <Metric kMetric, bool kAxes>
inline float pair_size(const ClusterWindow& w, std::uint32_t i, std::uint32_t j, float scale) {
  const float x = max_of(w.hi_x[i], w.hi_x[j]) - min_of(w.lo_x[i], w.lo_x[j]);
  const float y = max_of(w.hi_y[i], w.hi_y[j]) - min_of(w.lo_y[i], w.lo_y[j]);
  const float z = max_of(w.hi_z[i], w.hi_z[j]) - min_of(w.lo_z[i], w.lo_z[j]);
  const float diagonal_sq = x * x + y * y + z * z;
  if constexpr (kMetric == Metric::walter) {
    const float cosine =
        kAxes ? united_cosine(w.axis(i), w.cosine[i], w.sine[i], w.axis(j), w.cosine[j], w.sine[j]) : 1.0f;
    return walter_size(w.luminance[i] + w.luminance[j], diagonal_sq, cosine, scale);
  } else {
    float sum = std::sqrt(diagonal_sq) * scale;
    if constexpr (kMetric == Metric::distance_color || kMetric == Metric::distance_color_direction)
      sum += colour_difference(w.color(i), w.color(j));
    if constexpr (kAxes) sum += 0.25f * length_sq(w.axis(i) - w.axis(j));
    return sum;
  }
}

/// Ranks all pairs up to `radius` apart whose lower cluster is one of the first `lower_count` of the window.
template <Metric kMetric, bool kAxes>
void rank_pairs(ClusterWindow& w, std::uint32_t first_position, std::uint32_t lower_count, std::uint32_t count,
                std::uint32_t radius, float scale) {
  for (std::uint32_t offset = 1; offset <= radius && offset < count; ++offset) {
    const std::uint32_t end = min_of(lower_count, count - offset);
    for (std::uint32_t i = 0; i < end; ++i) {
      const float rank = ploc_rank(pair_size<kMetric, kAxes>(w, i, i + offset, scale), first_position + i, offset);
      w.up[i] = min_of(w.up[i], rank);
      w.down[i + offset] = min_of(w.down[i + offset], rank);
    }
  }
}

using RankPairs = void (*)(ClusterWindow&, std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t, float);

RankPairs rank_pairs_for(const MetricScale& scale) {
  switch (scale.metric) {
    case Metric::walter:
      return scale.direction_extent_sq > 0 ? rank_pairs<Metric::walter, true> : rank_pairs<Metric::walter, false>;
    case Metric::distance:
      return rank_pairs<Metric::distance, false>;
    case Metric::distance_color:
      return rank_pairs<Metric::distance_color, false>;
    case Metric::distance_direction:
      return rank_pairs<Metric::distance_direction, true>;
    case Metric::distance_color_direction:
      return rank_pairs<Metric::distance_color_direction, true>;
  }
  return rank_pairs<Metric::walter, true>;
}

/// Clusters along the curve, halved round by round.
class LocalMerging {
 public:
  LocalMerging(const LeafClusters& leaves, const PlocOptions& options)
      : scale_(leaves.scale), radius_(clamp_to(options.radius, 1u, kLargestPlocRadius)) {
    const std::vector<KeyedLight> order = sort_by_key(leaves.clusters, options.layout);
    clusters_.resize(order.size());
    ids_.resize(order.size());
    for_blocks([&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t i = begin; i < end; ++i) {
        clusters_[i] = leaves.clusters[order[i].light];
        ids_[i] = order[i].light;
      }
    });
    next_id_ = static_cast<std::uint32_t>(order.size());
    merges_.children.resize(order.size() - 1);
    first_id_ = next_id_;
  }

  [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(clusters_.size()); }

  /// Merges all pairs that chose each other. Where each prefers the next (lights in a row, ever brighter) hardly any do:
  /// then neighbours merge if one of both wants, and if that does not help either, whether they want or not.
  void round() {
    const std::uint32_t before = count();
    choose_partners();
    if (reluctance_ > 0) pair_neighbours(reluctance_ > 1);
    merge_mutual();
    const bool stuck = before - count() < before / 64;
    reluctance_ = stuck ? min_of(reluctance_ + 1, 2) : 0;
  }

  /// Hands the rest to the greedy builder.
  MergeTree finish() {
    const MergeTree top = build_agglomerative({clusters_, scale_});
    const std::uint32_t top_leaves = count();
    for (std::size_t k = 0; k < top.children.size(); ++k) {
      const auto id_of = [&](std::uint32_t id) { return id < top_leaves ? ids_[id] : next_id_ + (id - top_leaves); };
      merges_.children[next_id_ - first_id_ + k] = {id_of(top.children[k][0]), id_of(top.children[k][1])};
    }
    return std::move(merges_);
  }

 private:
  template <class Body>
  void for_blocks(const Body& body) const {
    const std::uint32_t n = count();
    const std::uint32_t blocks = (n + kBlock - 1) / kBlock;
    tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, blocks, 4), [&](const auto& range) {
      for (std::uint32_t b = range.begin(); b < range.end(); ++b) body(b * kBlock, min_of((b + 1) * kBlock, n));
    });
  }

  void choose_partners();
  void pair_neighbours(bool whether_they_want_or_not);
  void merge_mutual();

  MetricScale scale_;
  std::uint32_t radius_;
  std::vector<LightCluster> clusters_, next_clusters_;
  std::vector<std::uint32_t> ids_, next_ids_;
  std::vector<std::int32_t> offsets_;  ///< to the partner each cluster chose
  MergeTree merges_;
  std::uint32_t first_id_ = 0, next_id_ = 0;
  int reluctance_ = 0;  ///< rounds before that merged hardly anything
};

void LocalMerging::choose_partners() {
  offsets_.resize(clusters_.size());
  const RankPairs rank = rank_pairs_for(scale_);
  const float metric_scale = scale_.metric == Metric::walter ? scale_.direction_extent_sq : scale_.inverse_extent;
  for_blocks([&](std::uint32_t begin, std::uint32_t end) {
    thread_local ClusterWindow window;
    // A window from `radius` before the block, for pairs with clusters further down, to as far behind it.
    const std::uint32_t first = begin - min_of(begin, radius_), last = min_of(end + radius_, count());
    window.load(clusters_.data() + first, last - first);
    rank(window, first, end - first, last - first, radius_, metric_scale);
    for (std::uint32_t i = begin; i < end; ++i)
      offsets_[i] = ploc_offset(window.up[i - first], window.down[i - first], i);
  });
}

void LocalMerging::pair_neighbours(bool whether_they_want_or_not) {
  for (std::uint32_t i = 0; i + 1 < count(); i += 2) {
    if (whether_they_want_or_not || offsets_[i] == 1 || offsets_[i + 1] == -1) {
      offsets_[i] = 1;
      offsets_[i + 1] = -1;
    }
  }
}

void LocalMerging::merge_mutual() {
  const std::uint32_t n = count();
  const std::uint32_t blocks = (n + kBlock - 1) / kBlock;
  const auto partner_of = [&](std::uint32_t i) {
    return static_cast<std::uint32_t>(static_cast<std::int64_t>(i) + offsets_[i]);
  };
  const auto merges = [&](std::uint32_t i) { return offsets_[partner_of(i)] == -offsets_[i]; };

  // Where each block's survivors and merges go: its place depends on the blocks before alone, never on threads.
  std::vector<std::array<std::uint32_t, 2>> place(blocks + 1, {0, 0});
  for_blocks([&](std::uint32_t begin, std::uint32_t end) {
    std::uint32_t survivors = 0, merged = 0;
    for (std::uint32_t i = begin; i < end; ++i) {
      const bool pairs = merges(i), lower = offsets_[i] > 0;
      survivors += !pairs || lower;
      merged += pairs && lower;
    }
    place[begin / kBlock + 1] = {survivors, merged};
  });
  for (std::uint32_t b = 0; b < blocks; ++b)
    place[b + 1] = {place[b][0] + place[b + 1][0], place[b][1] + place[b + 1][1]};

  next_clusters_.resize(place[blocks][0]);
  next_ids_.resize(place[blocks][0]);
  for_blocks([&](std::uint32_t begin, std::uint32_t end) {
    auto [slot, merged] = place[begin / kBlock];
    for (std::uint32_t i = begin; i < end; ++i) {
      if (!merges(i)) {
        next_clusters_[slot] = clusters_[i];
        next_ids_[slot++] = ids_[i];
      } else if (offsets_[i] > 0) {
        const std::uint32_t j = partner_of(i);
        next_clusters_[slot] = unite(clusters_[i], clusters_[j]);
        merges_.children[next_id_ - first_id_ + merged] = {ids_[i], ids_[j]};
        next_ids_[slot++] = next_id_ + merged++;
      }
    }
  });
  next_id_ += place[blocks][1];
  clusters_.swap(next_clusters_);
  ids_.swap(next_ids_);
}

}  // namespace

MergeTree build_ploc(const LeafClusters& leaves, const PlocOptions& options, const BuildProgress& progress) {
  LocalMerging merging(leaves, options);
  const auto light_count = static_cast<double>(leaves.clusters.size());
  while (merging.count() > max_of(options.greedy_below, 1u)) {
    if (progress && !progress(1 - merging.count() / light_count)) return {};
    merging.round();
  }
  return merging.finish();
}

}  // namespace lightcuts
