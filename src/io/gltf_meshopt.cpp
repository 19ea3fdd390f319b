#include "io/gltf_meshopt.h"

#include <fmt/format.h>
#include <meshoptimizer.h>

namespace lightcuts::gltf {
namespace {

constexpr std::uint64_t kLargestStride = 256;

enum class Mode : std::uint8_t { attributes, triangles, indices };

Mode read_mode(const JsonValue& compression) {
  const JsonValue member = compression.require("mode");
  const std::string mode = member.string();
  if (mode == "ATTRIBUTES") return Mode::attributes;
  if (mode == "TRIANGLES") return Mode::triangles;
  if (mode == "INDICES") return Mode::indices;
  member.fail("expected ATTRIBUTES, TRIANGLES or INDICES.");
}

/// The library takes these for granted.
void check_sizes(const JsonValue& compression, Mode mode, std::uint64_t count, std::uint64_t stride) {
  const bool stride_fits = mode == Mode::attributes ? stride % 4 == 0 && stride >= 4 && stride <= kLargestStride
                                                    : stride == 2 || stride == 4;
  if (!stride_fits) compression.find("byteStride").fail(fmt::format("{} does not fit the mode.", stride));
  if (mode == Mode::triangles && count % 3 != 0) compression.find("count").fail("expected a multiple of 3.");
}

/// At what size of elements a filter works, as its name says.
void apply_filter(const JsonValue& compression, Bytes& bytes, std::uint64_t count, std::uint64_t stride) {
  const JsonValue member = compression.find("filter");
  const std::string filter = member.string_or("NONE");
  if (filter == "NONE") return;
  if (filter == "OCTAHEDRAL" && (stride == 4 || stride == 8)) {
    meshopt_decodeFilterOct(bytes.data(), count, stride);
  } else if (filter == "QUATERNION" && stride == 8) {
    meshopt_decodeFilterQuat(bytes.data(), count, stride);
  } else if (filter == "EXPONENTIAL" && stride % 4 == 0) {
    meshopt_decodeFilterExp(bytes.data(), count, stride);
  } else {
    member.fail(
        fmt::format("the filter {} is unknown or does not fit a stride of {} bytes.", readable_name(filter), stride));
  }
}

}  // namespace

Bytes decode_meshopt(const JsonValue& view, const JsonValue& compression, std::span<const std::byte> data,
                     MemoryBudget& budget) {
  const Mode mode = read_mode(compression);
  const std::uint64_t count = compression.require("count").count();
  const std::uint64_t stride = compression.require("byteStride").count();
  check_sizes(compression, mode, count, stride);
  if (count > view.require("byteLength").count() / stride) {
    compression.find("count").fail(
        fmt::format("{} elements of {} bytes do not fit the view's byteLength.", count, stride));
  }
  budget.charge(count * stride, compression);
  Bytes bytes(count * stride);
  const auto* first = reinterpret_cast<const unsigned char*>(data.data());
  int status = 0;
  switch (mode) {
    case Mode::attributes:
      status = meshopt_decodeVertexBuffer(bytes.data(), count, stride, first, data.size());
      break;
    case Mode::triangles:
      status = meshopt_decodeIndexBuffer(bytes.data(), count, stride, first, data.size());
      break;
    case Mode::indices:
      status = meshopt_decodeIndexSequence(bytes.data(), count, stride, first, data.size());
      break;
  }
  if (status != 0) compression.fail("the bytes are no meshopt stream of this mode and count. Export the scene again.");
  if (mode == Mode::attributes) apply_filter(compression, bytes, count, stride);
  return bytes;
}

}  // namespace lightcuts::gltf
