#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace lightcuts::gltf {

using Triangle = std::array<std::uint32_t, 3>;

/// glTF's numbers of the primitive modes that make triangles.
enum class TriangleMode : std::uint8_t { triangles = 4, strip = 5, fan = 6 };

/// How many triangles `count` corners make.
std::uint64_t triangle_count(TriangleMode mode, std::uint64_t count);

/// Triangles of a strip or fan given by its corners; those with two equal corners, which join strips, are left out.
/// Every second triangle of a strip is turned, so that all face one side.
std::vector<Triangle> unroll(TriangleMode mode, std::span<const std::uint32_t> corners);

/// The vertices that triangles use, ascending, and the triangles renumbered to them.
///
/// Many primitives may share one large vertex buffer; each keeps what it uses. Costs n log n in the triangles' number
/// and does not depend on the buffer's size.
std::vector<std::uint32_t> keep_used_vertices(std::vector<Triangle>& triangles);

}  // namespace lightcuts::gltf
