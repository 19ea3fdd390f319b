#pragma once

#include "cpu/tree/merge_tree.h"
#include "lightcuts/lights.h"

namespace lightcuts {

/// Clusters of one VPL each. `scene_diagonal` [m] is Walter's c and the study's alpha_S.
LeafClusters leaf_clusters(const std::vector<Vpl>& lights, Metric metric, float scene_diagonal);

/// Clusters of one point or spot light each. The cone holds every direction into which a light shines. Walter's c is 0.
LeafClusters leaf_clusters(const std::vector<PointLight>& lights, Metric metric, float scene_diagonal);

/// Clusters of one directional light each: "positions" are unit directions towards the lights, the scene's diagonal is
/// the sphere's diameter. Walter's c is 0.
LeafClusters leaf_clusters(const std::vector<DirectionalLight>& lights, Metric metric);

}  // namespace lightcuts
