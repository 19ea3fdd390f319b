#include "io/gltf_extensions.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>

namespace lightcuts::gltf {
namespace {

constexpr std::array<std::string_view, 9> kSupported{
    "KHR_draco_mesh_compression",
    "EXT_meshopt_compression",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "EXT_mesh_gpu_instancing",
    "KHR_node_visibility",
    "KHR_materials_pbrSpecularGlossiness",  // its diffuse part
};

/// Extensions that change how a surface reflects. A Lambertian picture of it is still right in all else, so they may
/// be required.
constexpr std::array<std::string_view, 14> kLambertianInstead{
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_materials_subsurface",
    "KHR_materials_volume_scatter",
};

template <std::size_t N>
bool contains(const std::array<std::string_view, N>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

struct Version {
  int major = 0, minor = 0;
};

Version read_version(const JsonValue& member) {
  const std::string text = member.string();
  const char* end = text.data() + text.size();
  Version version;
  const auto [dot, error] = std::from_chars(text.data(), end, version.major);
  if (error != std::errc{} || dot == end || *dot != '.') member.fail("expected a version such as \"2.0\".");
  const auto [rest, minor_error] = std::from_chars(dot + 1, end, version.minor);
  if (minor_error != std::errc{} || rest != end) member.fail("expected a version such as \"2.0\".");
  return version;
}

void check_version(Context& context) {
  const JsonValue asset = context.document.root().require("asset");
  const JsonValue least = asset.find("minVersion");
  const Version version = read_version(least ? least : asset.require("version"));
  const bool readable = version.major == 2 && (!least || version.minor == 0);
  if (!readable) {
    (least ? least : asset.find("version"))
        .fail(fmt::format("version {}.{} is not read, only glTF 2.0. Convert the scene.", version.major, version.minor),
              Code::unsupported);
  }
}

}  // namespace

void check_requirements(Context& context) {
  check_version(context);
  const JsonValue required = context.array("extensionsRequired");
  for (std::size_t i = 0; i < required.size(); ++i) {
    const std::string name = required[i].string();
    if (contains(kSupported, name) || contains(kLambertianInstead, name)) continue;
    required[i].fail(
        fmt::format("the file requires the extension {}, which is not supported. Export the scene without it.",
                    readable_name(name)),
        Code::unsupported);
  }
  const JsonValue used = context.array("extensionsUsed");
  for (std::size_t i = 0; i < used.size(); ++i) {
    const std::string name = used[i].string();
    if (contains(kSupported, name)) continue;
    context.warnings.add(fmt::format("{}: the extension {} is ignored{}.", context.document.file(), readable_name(name),
                                     contains(kLambertianInstead, name) ? " until glossy reflection lands" : ""));
  }
}

}  // namespace lightcuts::gltf
