#include "io/gltf_primitive.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "io/gltf_draco.h"
#include "io/gltf_triangles.h"

namespace lightcuts::gltf {
namespace {

constexpr std::uint64_t kLargestMode = 6;
constexpr std::uint64_t kFirstTriangleMode = 4;

/// Above it a float cannot tell where in a texel it is; kernels may convert what is below it to integers.
constexpr float kLargestTexcoord = 1 << 20;

// Elements are read as packed floats straight into these.
static_assert(sizeof(Vec3) == 3 * sizeof(float) && sizeof(Vec2) == 2 * sizeof(float));
static_assert(sizeof(Triangle) == 3 * sizeof(std::uint32_t));

/// Reads one primitive. Holds what its steps share.
class PrimitiveReader {
 public:
  PrimitiveReader(const JsonValue& primitive, Context& context, Buffers& buffers)
      : primitive_(primitive), attributes_(primitive.require("attributes")), context_(context), buffers_(buffers) {
    const JsonValue compression = primitive.find("extensions").find("KHR_draco_mesh_compression");
    if (compression) draco_ = decode_draco(primitive, compression, context, buffers);
    positions_ = open("POSITION", 3);
  }

  void read_triangles(Mesh& out);
  void read_positions(Mesh& out) { out.positions = read<Vec3>(positions_); }
  void read_normals(Mesh& out);
  void read_texcoords(std::size_t set, Mesh& out);
  void read_colors(Mesh& out);
  void add_targets(const JsonValue& weights, Mesh& out);

 private:
  Accessor open(const std::string& name, std::size_t width);
  Accessor open(const JsonValue& reference, std::size_t width);
  void check_vertices(const Accessor& accessor, std::size_t width) const;
  std::vector<std::uint32_t> read_corners(TriangleMode mode);
  std::vector<Triangle> read_list();
  std::optional<Accessor> index_accessor();
  void check_corners(const std::uint32_t* corners, std::size_t count) const;
  void add_target(const JsonValue& reference, float weight, std::vector<Vec3>& values);

  [[nodiscard]] std::size_t vertex_count() const { return subset_.empty() ? positions_.count : subset_.size(); }

  template <class Element>
  std::vector<Element> read(const Accessor& accessor) {
    context_.budget.charge(vertex_count() * sizeof(Element), accessor.where);
    std::vector<Element> out(vertex_count());
    read_floats(accessor, subset_, reinterpret_cast<float*>(out.data()));
    return out;
  }

  JsonValue primitive_;
  JsonValue attributes_;
  Context& context_;
  Buffers& buffers_;
  std::optional<DracoPrimitive> draco_;
  Accessor positions_;
  std::vector<std::uint32_t> subset_;  ///< vertices in use, ascending; empty: all
};

void PrimitiveReader::check_vertices(const Accessor& accessor, std::size_t width) const {
  if (accessor.type.width != width) accessor.where.fail(fmt::format("expected elements of {} components here.", width));
}

Accessor PrimitiveReader::open(const JsonValue& reference, std::size_t width) {
  Accessor accessor = open_accessor(reference, context_, buffers_);
  check_vertices(accessor, width);
  return accessor;
}

Accessor PrimitiveReader::open(const std::string& name, std::size_t width) {
  const JsonValue reference = attributes_.find(name.c_str());
  if (draco_) {
    const auto unpacked = draco_->attributes.find(name);
    if (unpacked != draco_->attributes.end()) {
      Accessor accessor = open_accessor_on(reference, context_, unpacked->second);
      check_vertices(accessor, width);
      return accessor;
    }
  }
  Accessor accessor = open(reference, width);
  if (name != "POSITION" && accessor.count != positions_.count) {
    accessor.where.fail(fmt::format("{} elements for {} positions; expected as many. Export the scene again.",
                                    accessor.count, positions_.count));
  }
  return accessor;
}

std::optional<Accessor> PrimitiveReader::index_accessor() {
  const JsonValue reference = primitive_.find("indices");
  if (draco_) {
    Accessor accessor;
    accessor.where = primitive_;
    accessor.type = {Component::u32, 1};
    accessor.count = draco_->indices.size() / sizeof(std::uint32_t);
    accessor.data = draco_->indices.data();
    accessor.stride = sizeof(std::uint32_t);
    return accessor;
  }
  if (!reference) return std::nullopt;
  return open(reference, 1);
}

void PrimitiveReader::check_corners(const std::uint32_t* corners, std::size_t count) const {
  const std::uint32_t* largest = std::max_element(corners, corners + count);
  if (count > 0 && *largest >= positions_.count) {
    const JsonValue indices = primitive_.find("indices");
    (indices ? indices : primitive_)
        .fail(fmt::format("index {} at position {} is beyond the {} vertices. Export the scene again.", *largest,
                          largest - corners, positions_.count));
  }
}

std::vector<std::uint32_t> PrimitiveReader::read_corners(TriangleMode mode) {
  const std::optional<Accessor> indices = index_accessor();
  const std::size_t count = indices ? indices->count : positions_.count;
  context_.budget.charge(count * sizeof(std::uint32_t) + triangle_count(mode, count) * sizeof(Triangle), primitive_);
  std::vector<std::uint32_t> corners(count);
  if (indices) {
    read_indices(*indices, count, corners.data());
    check_corners(corners.data(), count);
  } else {
    std::iota(corners.begin(), corners.end(), 0u);
  }
  return corners;
}

std::vector<Triangle> PrimitiveReader::read_list() {
  const std::optional<Accessor> indices = index_accessor();
  const std::size_t count = indices ? indices->count : positions_.count;
  if (count % 3 != 0) {
    context_.warnings.add_at(primitive_, "corners",
                             fmt::format("{} corners are no whole number of triangles; the rest was left out.", count),
                             kToldPlaces);
  }
  context_.budget.charge(count / 3 * sizeof(Triangle), primitive_);
  std::vector<Triangle> triangles(count / 3);
  std::uint32_t* corners = triangles.empty() ? nullptr : triangles[0].data();
  if (indices) {
    read_indices(*indices, triangles.size() * 3, corners);
    check_corners(corners, triangles.size() * 3);
  } else {
    std::iota(corners, corners + triangles.size() * 3, 0u);
  }
  return triangles;
}

void PrimitiveReader::read_triangles(Mesh& out) {
  const auto mode = static_cast<TriangleMode>(primitive_.find("mode").count_or(kFirstTriangleMode));
  // Draco always unpacks to a list, whatever the primitive was before.
  const bool list = mode == TriangleMode::triangles || draco_;
  out.triangles = list ? read_list() : unroll(mode, read_corners(mode));
  if (out.triangles.size() * 3 < positions_.count) {
    context_.budget.charge(out.triangles.size() * sizeof(Triangle), primitive_);
    subset_ = keep_used_vertices(out.triangles);
  }
}

void PrimitiveReader::read_normals(Mesh& out) {
  if (attributes_.find("NORMAL")) out.normals = read<Vec3>(open("NORMAL", 3));
}

void PrimitiveReader::read_texcoords(std::size_t set, Mesh& out) {
  const std::string name = fmt::format("TEXCOORD_{}", set);
  if (!attributes_.find(name.c_str())) {
    context_.warnings.add_at(attributes_, name,
                             fmt::format("the material's textures need {}, which is missing; (0, 0) is used.", name));
    return;
  }
  out.texcoords[set] = read<Vec2>(open(name, 2));
  std::size_t broken = 0;
  for (Vec2& uv : out.texcoords[set]) {
    if (std::abs(uv.x) <= kLargestTexcoord && std::abs(uv.y) <= kLargestTexcoord) continue;
    uv = {};
    ++broken;
  }
  if (broken > 0) {
    context_.warnings.add_at(
        attributes_, "finite",
        fmt::format("{} elements of {} are not finite or far too large; (0, 0) is used.", broken, name), kToldPlaces);
  }
}

std::uint8_t to_byte(float value) {
  if (!(value > 0)) return 0;
  return static_cast<std::uint8_t>(std::lround(std::min(value, 1.0f) * 255.0f));
}

void PrimitiveReader::read_colors(Mesh& out) {
  const JsonValue reference = attributes_.find("COLOR_0");
  if (!reference) return;
  const std::size_t width = read_element_type(reference, context_).width == 4 ? 4 : 3;
  const Accessor accessor = open("COLOR_0", width);
  context_.budget.charge(vertex_count() * 4, accessor.where);
  std::vector<float> values(vertex_count() * width);
  read_floats(accessor, subset_, values.data());
  out.colors.resize(vertex_count());
  for (std::size_t i = 0; i < out.colors.size(); ++i) {
    for (std::size_t c = 0; c < 4; ++c) out.colors[i][c] = c < width ? to_byte(values[i * width + c]) : 255;
  }
}

void PrimitiveReader::add_target(const JsonValue& reference, float weight, std::vector<Vec3>& values) {
  if (!reference || values.empty()) return;
  const Accessor accessor = open(reference, 3);
  if (accessor.count != positions_.count)
    accessor.where.fail(fmt::format("expected {} elements, one a position.", positions_.count));
  const std::vector<Vec3> offsets = read<Vec3>(accessor);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] += offsets[i] * weight;
}

void PrimitiveReader::add_targets(const JsonValue& weights, Mesh& out) {
  const JsonValue targets = primitive_.find("targets");
  const std::size_t count = std::min(weights.size(), targets.size());
  for (std::size_t i = 0; i < count; ++i) {
    const auto weight = static_cast<float>(weights[i].number());
    if (weight == 0) continue;
    add_target(targets[i].find("POSITION"), weight, out.positions);
    add_target(targets[i].find("NORMAL"), weight, out.normals);
  }
}

}  // namespace

bool has_triangles(const JsonValue& primitive, Context& context) {
  const JsonValue member = primitive.find("mode");
  const std::uint64_t mode = member.count_or(kFirstTriangleMode);
  if (mode > kLargestMode) member.fail(fmt::format("{} is no primitive mode; expected 0 to 6.", mode));
  if (mode < kFirstTriangleMode) {
    context.warnings.add_at(member, "mode", "points and lines are not drawn; such primitives were left out.");
    return false;
  }
  if (!primitive.require("attributes").find("POSITION")) {
    context.warnings.add_at(primitive, "POSITION", "a primitive without positions was left out.");
    return false;
  }
  return true;
}

void read_geometry(const JsonValue& mesh, const JsonValue& primitive, WantedTexcoords wanted, Context& context,
                   Buffers& buffers, Mesh& out) {
  PrimitiveReader reader(primitive, context, buffers);
  reader.read_triangles(out);
  if (out.triangles.empty()) return;
  reader.read_positions(out);
  reader.read_normals(out);
  for (std::size_t set = 0; set < 2; ++set) {
    if (wanted.set[set]) reader.read_texcoords(set, out);
  }
  reader.read_colors(out);
  reader.add_targets(mesh.find("weights"), out);
}

}  // namespace lightcuts::gltf
