#include "io/gltf_buffers.h"

#include <fmt/format.h>

#include "io/gltf_meshopt.h"

namespace lightcuts::gltf {
namespace {

constexpr std::size_t kLargestStride = 252;

std::size_t read_stride(const JsonValue& view, Context& context) {
  const JsonValue member = view.find("byteStride");
  const std::uint64_t stride = member.count_or(0);
  if (member && (stride == 0 || stride > kLargestStride || stride % 4 != 0)) {
    // Harmless as long as every element lies inside the view, which accessors check.
    if (stride == 0 || stride > std::numeric_limits<std::uint32_t>::max()) {
      member.fail(fmt::format("expected a stride of 4 to {} bytes.", kLargestStride));
    }
    context.warnings.add_at(
        member, "stride",
        fmt::format("{} bytes: glTF wants a multiple of 4 up to {}. It was read as written.", stride, kLargestStride));
  }
  return stride;
}

}  // namespace

std::span<const std::byte> Buffers::load(const JsonValue& buffer, std::uint64_t index) {
  const JsonValue uri = buffer.find("uri");
  if (uri) {
    const Bytes& bytes = loaded_.emplace(index, read_uri(uri, context_.folder)).first->second;
    context_.budget.add_input(bytes.size());
    return bytes;
  }
  if (index == 0 && binary_) return *binary_;
  if (index == 0)
    buffer.fail("the buffer has neither a uri nor a binary chunk in a .glb file. Export the scene again.");
  buffer.fail("the buffer has no uri. Export the scene again.");
}

std::span<const std::byte> Buffers::buffer(const JsonValue& reference) {
  const JsonValue buffer = reference.follow(buffers_, "a buffer");
  const std::uint64_t index = reference.count();
  const std::uint64_t length = buffer.require("byteLength").count();
  const auto found = loaded_.find(index);
  const std::span<const std::byte> bytes = found != loaded_.end() ? found->second : load(buffer, index);
  if (length > bytes.size()) {
    buffer.find("byteLength")
        .fail(fmt::format("{} bytes announced, {} found. Copy or export the file again.", length, bytes.size()));
  }
  return bytes.first(length);
}

std::span<const std::byte> Buffers::slice(const JsonValue& place) {
  const std::span<const std::byte> whole = buffer(place.require("buffer"));
  const std::uint64_t offset = place.find("byteOffset").count_or(0);
  const std::uint64_t length = place.require("byteLength").count();
  if (offset > whole.size() || length > whole.size() - offset) {
    place.fail(fmt::format("byteOffset {} and byteLength {} leave the buffer of {} bytes. Export the scene again.",
                           offset, length, whole.size()));
  }
  return whole.subspan(offset, length);
}

const Bytes& Buffers::decompressed(const JsonValue& view, const JsonValue& compression, std::uint64_t index) {
  const auto found = decompressed_.find(index);
  if (found != decompressed_.end()) return found->second;
  return decompressed_.emplace(index, decode_meshopt(view, compression, slice(compression), context_.budget))
      .first->second;
}

View Buffers::view(const JsonValue& reference) {
  const JsonValue view = reference.follow(views_, "a buffer view");
  const std::size_t stride = read_stride(view, context_);
  const JsonValue compression = view.find("extensions").find("EXT_meshopt_compression");
  if (compression) return {decompressed(view, compression, reference.count()), stride};
  return {slice(view), stride};
}

}  // namespace lightcuts::gltf
