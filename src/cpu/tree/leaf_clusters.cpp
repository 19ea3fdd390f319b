#include "cpu/tree/leaf_clusters.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

namespace lightcuts {
namespace {

/// Darkest light of a metric relative to the brightest one. Walter's metric is 0 for lights without intensity wherever
/// they are; with this floor they too are clustered by place. It changes no sum.
constexpr float kLuminanceFloor = 1e-20f;

LightCluster cluster_of(const Vpl& light) {
  return {{light.position, light.position}, {light.axis, 1}, light.intensity, {}, 0};
}

LightCluster cluster_of(const PointLight& light) {
  const bool spot = light.cos_outer >= -1;
  const DirectionCone lit = spot ? DirectionCone{light.axis, light.cos_outer} : DirectionCone{{0, 0, 1}, -1};
  return {{light.position, light.position}, lit, light.intensity, {}, 0};
}

LightCluster cluster_of(const DirectionalLight& light) {
  const Vec3 towards = -light.direction;
  return {{towards, towards}, {{0, 0, 1}, -1}, light.irradiance, {}, 0};
}

bool uses_color(Metric metric) {
  return metric == Metric::distance_color || metric == Metric::distance_color_direction;
}

template <class Light>
LeafClusters make_leaf_clusters(const std::vector<Light>& lights, const MetricScale& scale) {
  LeafClusters leaves{std::vector<LightCluster>(lights.size()), scale};
  using Range = tbb::blocked_range<std::size_t>;
  const float brightest = tbb::parallel_reduce(
      Range(0, lights.size(), 4096), 0.0f,
      [&](const Range& range, float largest) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
          LightCluster& cluster = leaves.clusters[i];
          cluster = cluster_of(lights[i]);
          if (uses_color(scale.metric)) cluster.color = chromaticity(cluster.intensity);
          cluster.luminance = luminance(cluster.intensity);
          largest = max_of(largest, cluster.luminance);
        }
        return largest;
      },
      [](float a, float b) { return max_of(a, b); });
  const float floor = brightest > 0 ? max_of(brightest * kLuminanceFloor, 1e-30f) : 1.0f;
  tbb::parallel_for(Range(0, lights.size(), 4096), [&](const Range& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i)
      leaves.clusters[i].luminance = max_of(leaves.clusters[i].luminance, floor);
  });
  return leaves;
}

MetricScale scale_of(Metric metric, float extent, float direction_extent) {
  return {metric, extent > 0 ? 1 / extent : 1.0f, direction_extent * direction_extent};
}

}  // namespace

LeafClusters leaf_clusters(const std::vector<Vpl>& lights, Metric metric, float scene_diagonal) {
  return make_leaf_clusters(lights, scale_of(metric, scene_diagonal, scene_diagonal));
}

LeafClusters leaf_clusters(const std::vector<PointLight>& lights, Metric metric, float scene_diagonal) {
  return make_leaf_clusters(lights, scale_of(metric, scene_diagonal, 0));
}

LeafClusters leaf_clusters(const std::vector<DirectionalLight>& lights, Metric metric) {
  return make_leaf_clusters(lights, scale_of(metric, 2, 0));
}

}  // namespace lightcuts
