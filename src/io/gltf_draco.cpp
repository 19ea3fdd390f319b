#include "io/gltf_draco.h"

#include <draco/compression/decode.h>
#include <draco/core/varint_decoding.h>
#include <draco/metadata/metadata_decoder.h>
#include <fmt/format.h>

#include <cstring>
#include <stdexcept>

#include "io/gltf_accessors.h"

namespace lightcuts::gltf {
namespace {

/// What the head of a stream promises.
struct Counts {
  std::uint32_t faces = 0;
  std::uint32_t points = 0;
};

/// The decoder works with about this much for each face and point.
constexpr std::uint64_t kBytesPerFace = 48;
constexpr std::uint64_t kBytesPerPoint = 32;
/// More faces than this for each compressed byte are not to be had: a quarter of a bit for connectivity and position.
constexpr std::uint64_t kFacesPerByte = 32;
constexpr std::uint64_t kFacesForFree = 1 << 16;

constexpr std::uint16_t kHasMetadata = 0x8000;

/// Reads past the head of a mesh stream (Draco bitstream 2.2). False if it is something else.
bool read_counts(std::span<const std::byte> data, Counts& counts) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(data.data()), data.size());
  std::array<char, 5> magic{};
  std::uint8_t major = 0, minor = 0, geometry = 0, method = 0;
  std::uint16_t flags = 0;
  if (!buffer.Decode(magic.data(), magic.size()) || std::memcmp(magic.data(), "DRACO", 5) != 0) return false;
  if (!buffer.Decode(&major) || !buffer.Decode(&minor) || !buffer.Decode(&geometry) || !buffer.Decode(&method) ||
      !buffer.Decode(&flags)) {
    return false;
  }
  if (major != 2 || minor != 2 || geometry != draco::TRIANGULAR_MESH) return false;
  if ((flags & kHasMetadata) != 0) {
    draco::GeometryMetadata metadata;
    if (!draco::MetadataDecoder().DecodeGeometryMetadata(&buffer, &metadata)) return false;
  }
  if (method == draco::MESH_SEQUENTIAL_ENCODING) {
    return draco::DecodeVarint(&counts.faces, &buffer) && draco::DecodeVarint(&counts.points, &buffer);
  }
  std::uint8_t traversal = 0;
  return buffer.Decode(&traversal) && draco::DecodeVarint(&counts.points, &buffer) &&
         draco::DecodeVarint(&counts.faces, &buffer);
}

std::unique_ptr<draco::Mesh> decode(const JsonValue& compression, std::span<const std::byte> data, Context& context) {
  Counts counts;
  if (!read_counts(data, counts))
    compression.fail("the bytes are no Draco mesh (bitstream 2.2). Export the scene again.");
  const std::uint64_t most = kFacesForFree + kFacesPerByte * data.size();
  if (counts.faces > most || counts.points > 3 * most) {
    compression.fail(fmt::format("the Draco stream of {} bytes claims {} faces and {} points. Export the scene again.",
                                 data.size(), counts.faces, counts.points));
  }
  context.budget.charge(counts.faces * kBytesPerFace + counts.points * kBytesPerPoint, compression);
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(data.data()), data.size());
  draco::Decoder decoder;
  auto result = decoder.DecodeMeshFromBuffer(&buffer);
  if (!result.ok()) {
    compression.fail(
        fmt::format("the Draco stream is broken ({}). Export the scene again.", result.status().error_msg_string()));
  }
  return std::move(result).value();
}

template <class T>
bool convert(const draco::PointAttribute& attribute, std::uint32_t points, std::size_t width, Bytes& out) {
  std::array<T, 16> element{};
  for (std::uint32_t i = 0; i < points; ++i) {
    const draco::AttributeValueIndex index = attribute.mapped_index(draco::PointIndex(i));
    if (index.value() >= attribute.size()) return false;
    if (!attribute.ConvertValue(index, static_cast<std::int8_t>(width), element.data())) return false;
    std::memcpy(out.data() + i * width * sizeof(T), element.data(), width * sizeof(T));
  }
  return true;
}

bool convert(Component component, const draco::PointAttribute& attribute, std::uint32_t points, std::size_t width,
             Bytes& out) {
  switch (component) {
    case Component::i8:
      return convert<std::int8_t>(attribute, points, width, out);
    case Component::u8:
      return convert<std::uint8_t>(attribute, points, width, out);
    case Component::i16:
      return convert<std::int16_t>(attribute, points, width, out);
    case Component::u16:
      return convert<std::uint16_t>(attribute, points, width, out);
    case Component::u32:
      return convert<std::uint32_t>(attribute, points, width, out);
    case Component::f32:
      return convert<float>(attribute, points, width, out);
  }
  return false;
}

Bytes unpack_attribute(const draco::Mesh& mesh, const JsonValue& id, const JsonValue& reference, Context& context) {
  const std::uint64_t unique_id = id.count();
  const draco::PointAttribute* attribute =
      unique_id <= 0xffffffffu ? mesh.GetAttributeByUniqueId(static_cast<std::uint32_t>(unique_id)) : nullptr;
  if (attribute == nullptr)
    id.fail(fmt::format("the Draco stream has no attribute {}. Export the scene again.", unique_id));
  const ElementType type = read_element_type(reference, context);
  const std::uint64_t bytes = std::uint64_t{mesh.num_points()} * type.byte_count();
  context.budget.charge(bytes, id);
  Bytes out(bytes);
  if (!convert(type.component, *attribute, mesh.num_points(), type.width, out)) {
    id.fail("the Draco stream's attribute does not fit its accessor. Export the scene again.");
  }
  return out;
}

Bytes unpack_indices(const draco::Mesh& mesh, const JsonValue& where, Context& context) {
  const std::uint64_t bytes = std::uint64_t{mesh.num_faces()} * 3 * sizeof(std::uint32_t);
  context.budget.charge(bytes, where);
  Bytes out(bytes);
  for (std::uint32_t i = 0; i < mesh.num_faces(); ++i) {
    const auto& face = mesh.face(draco::FaceIndex(i));
    const std::array<std::uint32_t, 3> corners{face[0].value(), face[1].value(), face[2].value()};
    std::memcpy(out.data() + i * sizeof corners, corners.data(), sizeof corners);
  }
  return out;
}

}  // namespace

DracoPrimitive decode_draco(const JsonValue& primitive, const JsonValue& compression, Context& context,
                            Buffers& buffers) {
  const View view = buffers.view(compression.require("bufferView"));
  std::unique_ptr<draco::Mesh> mesh;
  try {
    mesh = decode(compression, view.bytes, context);
  } catch (const std::length_error&) {
    compression.fail("the Draco stream is broken. Export the scene again.");
  }
  DracoPrimitive result;
  result.indices = unpack_indices(*mesh, compression, context);
  const JsonValue ids = compression.require("attributes");
  const JsonValue references = primitive.require("attributes");
  for (const auto& [name, value] : ids.members()) {
    if (const JsonValue reference = references.find(name.c_str())) {
      result.attributes.emplace(name, unpack_attribute(*mesh, ids.find(name.c_str()), reference, context));
    }
  }
  return result;
}

}  // namespace lightcuts::gltf
