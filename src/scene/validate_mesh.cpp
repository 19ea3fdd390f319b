#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>

#include "lightcuts/error.h"
#include "scene/limits.h"

namespace lightcuts {
namespace {

using Range = tbb::blocked_range<std::size_t>;
using Triangle = std::array<std::uint32_t, 3>;
constexpr std::size_t kGrain = 1 << 14;

/// How many of [0, count) satisfy a predicate, in parallel.
template <class Predicate>
std::uint64_t count_where(std::size_t count, Predicate predicate) {
  return tbb::parallel_reduce(
      Range(0, count, kGrain), std::uint64_t{0},
      [&](const Range& range, std::uint64_t sum) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) sum += predicate(i) ? 1 : 0;
        return sum;
      },
      std::plus<>());
}

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
  throw Error(Code::invalid_scene, where + " " + what);
}

void check_counts(const Mesh& mesh, const std::string& name) {
  if (mesh.positions.size() >= kNone || mesh.triangles.size() >= kNone) {
    refuse(name, "has more corners or triangles than 32 bits can count; split it into several meshes.");
  }
  const auto check = [&](std::size_t count, const char* what) {
    if (count != 0 && count != mesh.positions.size()) {
      refuse(name, fmt::format("has {} positions but {} {}; there must be one each, or none.", mesh.positions.size(),
                               count, what));
    }
  };
  check(mesh.normals.size(), "normals");
  for (const auto& texcoords : mesh.texcoords) check(texcoords.size(), "texture coordinates");
  check(mesh.colors.size(), "colours");
}

void check_indices(const Mesh& mesh, const std::string& name) {
  const auto outside = [&](const Triangle& t) { return std::max({t[0], t[1], t[2]}) >= mesh.positions.size(); };
  if (count_where(mesh.triangles.size(), [&](std::size_t i) { return outside(mesh.triangles[i]); }) == 0) return;
  const auto found = std::find_if(mesh.triangles.begin(), mesh.triangles.end(), outside);
  refuse(name, fmt::format("refers to position {} in triangle {}, but has {} positions.",
                           std::max({(*found)[0], (*found)[1], (*found)[2]}), found - mesh.triangles.begin(),
                           mesh.positions.size()));
}

void check_coordinates(const Mesh& mesh, const std::string& name) {
  const auto is_large = [&](std::size_t i) {
    const Vec3 p = mesh.positions[i];
    return is_finite(p) && std::max({std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)}) > kLargestCoordinate;
  };
  if (const std::uint64_t count = count_where(mesh.positions.size(), is_large); count > 0) {
    refuse(name, fmt::format("has {} beyond {:g} m, where squares of areas overflow; scale the scene down.",
                             counted(count, "position"), kLargestCoordinate));
  }
}

/// Twice the area as a vector; zero or NaN where there is none that a float can express.
Vec3 area_vector(const Mesh& mesh, const Triangle& t) {
  const Vec3 a = mesh.positions[t[0]];
  return cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a);
}

bool has_finite_corners(const Mesh& mesh, const Triangle& t) {
  return is_finite(mesh.positions[t[0]]) && is_finite(mesh.positions[t[1]]) && is_finite(mesh.positions[t[2]]);
}

bool has_area(const Mesh& mesh, const Triangle& t) { return std::isnormal(length_sq(area_vector(mesh, t))); }

/// Removes the triangles that cannot be hit or whose normal is undefined.
void remove_bad_triangles(Mesh& mesh, const std::string& name, std::vector<std::string>& warnings) {
  const auto bad =
      count_where(mesh.triangles.size(), [&](std::size_t i) { return !has_area(mesh, mesh.triangles[i]); });
  if (bad == 0) return;
  const auto infinite = std::erase_if(mesh.triangles, [&](const Triangle& t) { return !has_finite_corners(mesh, t); });
  const auto flat = std::erase_if(mesh.triangles, [&](const Triangle& t) { return !has_area(mesh, t); });
  if (infinite > 0) {
    warnings.push_back(
        fmt::format("{}: removed {} with corners that are not finite numbers.", name, counted(infinite, "triangle")));
  }
  if (flat > 0) warnings.push_back(fmt::format("{}: removed {} without area.", name, counted(flat, "triangle")));
}

bool is_usable_normal(Vec3 n) {
  const float size = length_sq(n);
  return std::isnormal(size) && size > 1e-12f;
}

/// Sums the normals of adjacent triangles, weighted by area, where a normal is missing.
void compute_normals(Mesh& mesh, const std::vector<char>& is_missing) {
  for (std::size_t i = 0; i < is_missing.size(); ++i) {
    if (is_missing[i] != 0) mesh.normals[i] = {};
  }
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t corner : t) {
      if (is_missing[corner] != 0) mesh.normals[corner] += area_vector(mesh, t);
    }
  }
  // Where the sides cancel out (a leaf seen from both sides), any adjacent triangle will do.
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t corner : t) {
      if (is_missing[corner] != 0 && !std::isnormal(length_sq(mesh.normals[corner]))) {
        mesh.normals[corner] = area_vector(mesh, t);
      }
    }
  }
  for (std::size_t i = 0; i < is_missing.size(); ++i) {
    if (is_missing[i] == 0) continue;
    const float size = length(mesh.normals[i]);
    mesh.normals[i] = std::isnormal(size) ? mesh.normals[i] / size : Vec3{0, 0, 1};
  }
}

void repair_normals(Mesh& mesh, const std::string& name, std::vector<std::string>& warnings) {
  const auto is_missing = [&](std::size_t i) { return !is_usable_normal(mesh.normals[i]); };
  if (const auto count = count_where(mesh.normals.size(), is_missing); count > 0) {
    std::vector<char> missing(mesh.normals.size());
    for (std::size_t i = 0; i < missing.size(); ++i) missing[i] = is_missing(i) ? 1 : 0;
    compute_normals(mesh, missing);
    warnings.push_back(
        fmt::format("{}: computed {} that were zero or not finite numbers.", name, counted(count, "normal")));
  }
  // Normals of quantised files are a little off unit length; that is no mistake worth a sentence.
  tbb::parallel_for(Range(0, mesh.normals.size(), kGrain), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const float size = length_sq(mesh.normals[i]);
      if (std::fabs(size - 1.0f) > 1e-4f) mesh.normals[i] = mesh.normals[i] / std::sqrt(size);
    }
  });
}

void repair_texcoords(Mesh& mesh, const std::string& name, std::vector<std::string>& warnings) {
  for (auto& texcoords : mesh.texcoords) {
    const auto is_bad = [&](std::size_t i) {
      // Negated so that NaN counts as bad.
      return !(std::fabs(texcoords[i].x) <= kLargestTexcoord && std::fabs(texcoords[i].y) <= kLargestTexcoord);
    };
    const auto count = count_where(texcoords.size(), is_bad);
    if (count == 0) continue;
    for (std::size_t i = 0; i < texcoords.size(); ++i) {
      if (is_bad(i)) texcoords[i] = {};
    }
    warnings.push_back(fmt::format("{}: set {} to zero that were not finite numbers or beyond {:g}.", name,
                                   counted(count, "texture coordinate"), kLargestTexcoord));
  }
}

/// Positions that no triangle uses may be anything; give those that are not finite a harmless value, because a later
/// stage may copy or bound all positions.
void hide_unused_positions(Mesh& mesh) {
  const auto is_bad = [&](std::size_t i) { return !is_finite(mesh.positions[i]); };
  if (count_where(mesh.positions.size(), is_bad) == 0) return;
  const Vec3 harmless = mesh.triangles.empty() ? Vec3{} : mesh.positions[mesh.triangles.front()[0]];
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    if (is_bad(i)) mesh.positions[i] = harmless;
  }
}

}  // namespace

void validate_mesh(Mesh& mesh, std::size_t index, std::vector<std::string>& warnings) {
  const std::string name = label("mesh", index, mesh.name);
  check_counts(mesh, name);
  check_indices(mesh, name);
  check_coordinates(mesh, name);
  remove_bad_triangles(mesh, name, warnings);
  repair_normals(mesh, name, warnings);
  repair_texcoords(mesh, name, warnings);
  hide_unused_positions(mesh);
}

}  // namespace lightcuts
