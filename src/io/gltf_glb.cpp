#include "io/gltf_glb.h"

#include <fmt/format.h>

#include <cstring>

namespace lightcuts::gltf {
namespace {

constexpr std::uint32_t kMagic = 0x46546c67;        // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4e4f534a;    // "JSON"
constexpr std::uint32_t kBinaryChunk = 0x004e4942;  // "BIN"
constexpr std::size_t kHeaderBytes = 12;
constexpr std::size_t kChunkHeaderBytes = 8;

std::uint32_t little_endian(std::span<const std::byte> bytes, std::size_t offset) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value |= std::to_integer<std::uint32_t>(bytes[offset + i]) << (8 * i);
  return value;
}

[[noreturn]] void fail(const std::string& name, const std::string& what, Code code = Code::malformed) {
  throw Error(code, fmt::format("{}: {}. Copy or export the file again.", name, what));
}

/// The part of the file that its header speaks of.
std::span<const std::byte> checked_body(std::span<const std::byte> file, const std::string& name, Warnings& warnings) {
  if (!is_glb(file)) fail(name, "expected \"glTF\" in the first bytes of a .glb file");
  if (file.size() < kHeaderBytes) fail(name, "the file ends inside its header of 12 bytes");
  const std::uint32_t version = little_endian(file, 4);
  if (version != 2) fail(name, fmt::format("byte 4: version {}; only glTF 2.0 is read", version), Code::unsupported);
  const std::uint32_t length = little_endian(file, 8);
  if (length < kHeaderBytes + kChunkHeaderBytes || length > file.size()) {
    fail(name, fmt::format("byte 8: the header says {} bytes, the file has {}", length, file.size()));
  }
  if (length < file.size()) {
    warnings.add(
        fmt::format("{}: {} bytes after the end that the header names were ignored.", name, file.size() - length));
  }
  return file.subspan(kHeaderBytes, length - kHeaderBytes);
}

}  // namespace

bool is_glb(std::span<const std::byte> file) { return file.size() >= 4 && little_endian(file, 0) == kMagic; }

Container split_glb(std::span<const std::byte> file, const std::string& name, Warnings& warnings) {
  std::span<const std::byte> rest = checked_body(file, name, warnings);
  Container container;
  for (std::size_t chunk = 0; !rest.empty(); ++chunk) {
    const std::string place = fmt::format("chunk {}", chunk);
    if (rest.size() < kChunkHeaderBytes) fail(name, place + ": the file ends inside the chunk's header");
    const std::uint32_t length = little_endian(rest, 0);
    const std::uint32_t type = little_endian(rest, 4);
    if (length > rest.size() - kChunkHeaderBytes) {
      fail(name, fmt::format("{}: {} bytes announced, {} left", place, length, rest.size() - kChunkHeaderBytes));
    }
    const auto data = rest.subspan(kChunkHeaderBytes, length);
    if (chunk == 0) {
      if (type != kJsonChunk) fail(name, "chunk 0: expected the JSON chunk first");
      container.json = {reinterpret_cast<const char*>(data.data()), data.size()};
    } else if (type == kBinaryChunk && !container.binary) {
      container.binary = data;
    } else {
      warnings.add(fmt::format("{}: {} is of an unknown kind or a duplicate and was ignored.", name, place));
    }
    rest = rest.subspan(kChunkHeaderBytes + length);
  }
  return container;
}

}  // namespace lightcuts::gltf
