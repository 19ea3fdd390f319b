#include "scene_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string_view>

#include "lightcuts/error.h"
#include "text.h"
#include "values.h"

namespace lightcuts::app {
namespace {

constexpr std::string_view kBuiltinPrefix = "builtin:";
constexpr float kDefaultFovDeg = 45;

std::vector<std::string> builtin_names() {
  std::vector<std::string> names;
  for (const BuiltinInfo& info : builtin_scenes()) names.push_back(info.name);
  return names;
}

std::string builtin_name(const std::string& spec) {
  const std::string rest = spec.substr(kBuiltinPrefix.size());
  return rest.substr(0, rest.find('?'));
}

LoadedScene open_builtin(const std::string& spec) {
  const std::string name = builtin_name(spec);
  const std::vector<std::string> names = builtin_names();
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    throw Error(Code::invalid_argument, fmt::format("there is no built-in scene '{}'; there are {}{}", name,
                                                    either(names), did_you_mean(name, names)));
  }
  return {make_builtin_scene(spec.substr(kBuiltinPrefix.size())), {}};
}

/// Radiance must be a finite number of at least 0 everywhere; returns how many values had to be replaced.
std::size_t repair_radiance(Image& image) {
  std::size_t repaired = 0;
  for (Channel& channel : image.channels) {
    for (float& value : channel.values) {
      if (std::isfinite(value) && value >= 0) continue;
      value = 0;
      ++repaired;
    }
  }
  return repaired;
}

Image rgb_image(const Image& image) {
  const std::vector<Vec3> pixels = rgb_pixels(image);
  Image out = make_rgb_image(image.width, image.height);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    for (int c = 0; c < 3; ++c) out.channels[static_cast<std::size_t>(c)].values[i] = component(pixels[i], c);
  }
  return out;
}

Environment load_environment(const std::string& file, std::vector<std::string>& warnings) {
  if (!std::filesystem::exists(file)) {
    throw Error(Code::file_missing,
                fmt::format("--environment {}: there is no such file, and it is no colour either; expected R,G,B, one "
                            "number, #rrggbb, or an equirectangular .hdr or .exr file",
                            file));
  }
  auto image = std::make_shared<Image>(rgb_image(load_image(file)));
  if (const std::size_t repaired = repair_radiance(*image); repaired > 0) {
    warnings.push_back(
        fmt::format("{}: {} values are negative, infinite or NaN; they were taken as 0", file, grouped(repaired)));
  }
  if (image->width != 2 * image->height) {
    warnings.push_back(fmt::format("{}: an equirectangular picture is twice as wide as high, this one has {}x{} pixels",
                                   file, image->width, image->height));
  }
  return {{1, 1, 1}, std::move(image)};
}

}  // namespace

LoadedScene open_scene(const std::string& spec) {
  if (spec.starts_with(kBuiltinPrefix)) return open_builtin(spec);
  std::error_code ignored;
  if (std::filesystem::is_directory(spec, ignored)) {
    throw Error(Code::unsupported, fmt::format("{}: this is a folder; name a scene file in it", spec));
  }
  if (!std::filesystem::exists(spec, ignored)) {
    const std::vector<std::string> names = builtin_names();
    const std::string similar = nearest(spec.substr(0, spec.find('?')), names);
    throw Error(Code::file_missing,
                fmt::format("{}: there is no such file; {}", spec.empty() ? "''" : spec,
                            similar.empty() ? "check the path, or see 'lightcuts scenes' for the built-in scenes"
                                            : fmt::format("for the built-in scene write builtin:{}", similar)));
  }
  return load_scene(spec);
}

std::string base_name(const std::string& spec) {
  if (spec.starts_with(kBuiltinPrefix)) return builtin_name(spec);
  const std::string stem = std::filesystem::path(spec).stem().string();
  return stem.empty() ? "scene" : stem;
}

void set_environment(LoadedScene& loaded, const std::string& colour_or_file) {
  const auto colour = parse_colour(colour_or_file);
  loaded.scene.environment = colour ? Environment{*colour, nullptr} : load_environment(colour_or_file, loaded.warnings);
}

Camera choose_camera(const Scene& scene, const CameraRequest& request) {
  constexpr float radians = kPi / 180;
  if (request.eye && request.target) {
    return look_at(*request.eye, *request.target, request.fov_deg.value_or(kDefaultFovDeg) * radians);
  }
  Camera camera = select_camera(scene, request.which);
  if (!request.fov_deg) return camera;
  if (camera.orthographic_height > 0) {
    throw Error(Code::invalid_argument,
                fmt::format("--fov: the camera '{}' is orthographic and has no angle; leave --fov out, or give --eye "
                            "and --target",
                            camera.name));
  }
  camera.vertical_fov_rad = *request.fov_deg * radians;
  return camera;
}

}  // namespace lightcuts::app
