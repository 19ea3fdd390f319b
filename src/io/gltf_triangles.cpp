#include "io/gltf_triangles.h"

#include <algorithm>

namespace lightcuts::gltf {

std::uint64_t triangle_count(TriangleMode mode, std::uint64_t count) {
  if (mode == TriangleMode::triangles) return count / 3;
  return count < 3 ? 0 : count - 2;
}

std::vector<Triangle> unroll(TriangleMode mode, std::span<const std::uint32_t> corners) {
  std::vector<Triangle> triangles;
  triangles.reserve(triangle_count(mode, corners.size()));
  for (std::size_t i = 0; i + 2 < corners.size(); ++i) {
    const std::size_t turned = i % 2;
    const Triangle triangle = mode == TriangleMode::strip
                                  ? Triangle{corners[i], corners[i + 1 + turned], corners[i + 2 - turned]}
                                  : Triangle{corners[i + 1], corners[i + 2], corners[0]};
    const bool joins = triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0];
    if (!joins) triangles.push_back(triangle);
  }
  return triangles;
}

std::vector<std::uint32_t> keep_used_vertices(std::vector<Triangle>& triangles) {
  std::vector<std::uint32_t> used;
  used.reserve(triangles.size() * 3);
  for (const Triangle& triangle : triangles) used.insert(used.end(), triangle.begin(), triangle.end());
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  for (Triangle& triangle : triangles) {
    for (std::uint32_t& corner : triangle) {
      corner = static_cast<std::uint32_t>(std::lower_bound(used.begin(), used.end(), corner) - used.begin());
    }
  }
  return used;
}

}  // namespace lightcuts::gltf
