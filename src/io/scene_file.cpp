#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <string_view>

#include "io/gltf.h"
#include "io/obj.h"
#include "lightcuts/error.h"
#include "lightcuts/io.h"

namespace lightcuts {
namespace {

enum class Format : std::uint8_t { gltf, obj, unknown };

std::string lower_ending(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

/// The first bytes of a file; empty if there are none or it cannot be read, which the reader will explain.
std::string first_bytes(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return {};
  std::array<char, 64> head{};
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), head.size());
  return {head.data(), static_cast<std::size_t>(file.gcount())};
}

/// Content first: a glTF file is known by its magic or its brace. OBJ has no such sign, so its ending counts.
Format format_of(const std::filesystem::path& path) {
  const std::string head = first_bytes(path);
  if (head.starts_with("glTF")) return Format::gltf;
  std::string_view text = head;
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first != std::string_view::npos && text[first] == '{') return Format::gltf;
  const std::string ending = lower_ending(path);
  if (ending == ".gltf" || ending == ".glb") return Format::gltf;
  if (ending == ".obj") return Format::obj;
  return Format::unknown;
}

LoadedScene load(const std::filesystem::path& path) {
  switch (format_of(path)) {
    case Format::gltf:
      return load_gltf(path);
#if __has_include("io/obj.h")
    case Format::obj:
      return load_obj(path);
#endif
    default:
      break;
  }
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    throw Error(Code::file_missing, fmt::format("{}: there is no such file. Check the name.", path.string()));
  }
  throw Error(Code::unsupported,
              fmt::format("{}: this is neither glTF (.gltf, .glb) nor OBJ (.obj). Convert the scene.", path.string()));
}

/// validate() does not know of files; whoever reads its sentences should.
std::vector<std::string> validate_file(const std::filesystem::path& path, Scene& scene) {
  try {
    return validate(scene);
  } catch (const Error& error) {
    throw Error(error.code(), fmt::format("{}: {}", path.string(), error.what()));
  }
}

}  // namespace

LoadedScene load_scene(const std::filesystem::path& path) {
  LoadedScene loaded = load(path);
  for (const std::string& sentence : validate_file(path, loaded.scene)) {
    loaded.warnings.push_back(fmt::format("{}: {}", path.string(), sentence));
  }
  return loaded;
}

}  // namespace lightcuts
