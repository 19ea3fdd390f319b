#pragma once

#include <vector>

#include "kernels/light_cluster.h"
#include "light_samples.h"
#include "lightcuts/lights.h"

// Small clusters for the tests of bounds.

namespace lightcuts::test {

inline LightCluster cluster_of_one(const Vpl& light) {
  return {{light.position, light.position}, {light.axis, 1}, {}, {}, 0};
}

inline LightCluster cluster_of_one(const PointLight& light) {
  const float lit = light.cos_outer >= -1 ? light.cos_outer : -1.0f;
  return {{light.position, light.position}, {light.axis, lit}, {}, {}, 0};
}

template <class Light>
LightCluster cluster_of(const std::vector<Light>& lights) {
  LightCluster sum = cluster_of_one(lights[0]);
  for (std::size_t i = 1; i < lights.size(); ++i) sum = unite(sum, cluster_of_one(lights[i]));
  return sum;
}

/// Lamps where the VPLs are: spots of any opening, or lamps that shine everywhere.
inline std::vector<PointLight> lamps_at(const std::vector<Vpl>& places, bool spots, LightSamples& samples) {
  std::vector<PointLight> lamps;
  for (const Vpl& place : places) {
    PointLight lamp{place.position, {1, 1, 1}, place.axis, -1, -2};
    if (spots) {
      lamp.cos_outer = samples.uniform(-1, 0.999f);
      lamp.cos_inner = samples.uniform(lamp.cos_outer, 1);
      if (!(lamp.cos_inner > lamp.cos_outer)) lamp.cos_inner = 1;
    }
    lamps.push_back(lamp);
  }
  return lamps;
}

}  // namespace lightcuts::test
