#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kernels/surface_points.h"

namespace lightcuts {

/// What is beyond the edges of a mesh's triangles; edge i runs from corner i to the next.
struct MeshEdges {
  std::vector<std::uint8_t> hard;                  ///< a triangle's edges that a disc must not reach across, as bits
  std::vector<std::array<std::uint32_t, 3>> next;  ///< the triangle in which the surface goes on, or kNone

  [[nodiscard]] MeshEdgesView view() const { return {hard.data(), next.empty() ? nullptr : next.data()->data()}; }
};

/// Finds the hard edges of a mesh, and across which edges its surface goes on.
///
/// Bits 0 to 2: hard as seen from the front; bits 3 to 5: from the back; bit 6: an edge has no neighbour at
/// all; bit 7: the triangle belongs to a closed body, whose inside lies behind it. An edge is hard where nothing continues the
/// surface (an open edge), or where all that does bends away sharply. Across a smooth edge a disc goes on over the neighbour;
/// across a hollow one it disappears behind it. Corners at the same place count as one, whatever their indices.
MeshEdges hard_edges(const MeshView& mesh);

}  // namespace lightcuts
