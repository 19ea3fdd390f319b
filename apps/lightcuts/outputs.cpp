#include "outputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "console.h"
#include "lightcuts/error.h"
#include "lightcuts/io.h"
#include "text.h"

namespace lightcuts::app {
namespace {

namespace fs = std::filesystem;

std::string ending(const fs::path& path) {
  std::string text = path.extension().string();
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

/// The layers that a picture of that method has.
std::vector<std::string> layers_of(Method method) {
  std::vector<std::string> names{"R",        "G",        "B",        "albedo.R", "albedo.G",
                                 "albedo.B", "normal.X", "normal.Y", "normal.Z", "depth.Z"};
  if (method == Method::lightcuts) names.insert(names.end(), {"cut.size", "cut.bound"});
  return names;
}

/// "depth" for "depth.Z": a layer of a single plane may be named without it.
std::string full_layer_name(const std::string& name, Method method) {
  const std::vector<std::string> names = layers_of(method);
  if (std::find(names.begin(), names.end(), name) != names.end()) return name;
  std::vector<std::string> planes;
  for (const std::string& candidate : names) {
    if (candidate.starts_with(name + ".")) planes.push_back(candidate);
  }
  if (planes.size() == 1) return planes.front();
  if (name.starts_with("cut")) {
    throw Error(Code::invalid_argument,
                fmt::format("--layer {}: {}", name,
                            method == Method::lightcuts ? "name one of " + either(planes)
                                                        : "only --method lightcuts makes the layers of the cut"));
  }
  throw Error(Code::invalid_argument, fmt::format("--layer {}: there will be no such layer; name one of {}{}", name,
                                                  either(planes.empty() ? names : planes), did_you_mean(name, names)));
}

void check_ending(const fs::path& path) {
  const std::string text = ending(path);
  if (text == ".exr" || text == ".png" || text == ".hdr") return;
  throw Error(Code::invalid_argument,
              fmt::format("--output {}: expected a name that ends in .exr (all layers), .png or .hdr", path.string()));
}

/// What a file is known by, however its path was written.
fs::path identity(const fs::path& path) {
  std::error_code ignored;
  const fs::path known = fs::weakly_canonical(fs::absolute(path, ignored), ignored);
  return known.empty() ? path : known;
}

void check_all_different(const std::vector<fs::path>& paths) {
  std::set<fs::path> seen;
  for (const fs::path& path : paths) {
    if (seen.insert(identity(path)).second) continue;
    throw Error(Code::invalid_argument,
                fmt::format("{}: named twice as an output; give each a name of its own", path.string()));
  }
}

void write_png(const fs::path& path, const Outputs& outputs, const Image& image, float exposure_ev) {
  if (outputs.layer.empty()) {
    save_png(path, tone_map(image, exposure_ev));
    print_result(fmt::format("wrote {}", path.string()));
    return;
  }
  const FalseColour shown = false_colour(image, outputs.layer);
  save_png(path, shown.picture);
  print_result(fmt::format(
      "wrote {}: {} from {:g} (dark violet) to {:g} (yellow){}", path.string(), outputs.layer, shown.low, shown.high,
      shown.not_finite == 0 ? "" : fmt::format(", {} pixels without a value (grey)", grouped(shown.not_finite))));
}

}  // namespace

void prepare(Outputs& outputs, const std::string& scene_name, Method method) {
  if (outputs.pictures.empty()) outputs.pictures = {scene_name + ".exr", scene_name + ".png"};
  for (const fs::path& path : outputs.pictures) check_ending(path);
  if (!outputs.layer.empty()) outputs.layer = full_layer_name(outputs.layer, method);
  std::vector<fs::path> all = outputs.pictures;
  if (outputs.stats == "-") {
    keep_stdout_for_content();
  } else if (!outputs.stats.empty()) {
    if (ending(outputs.stats) != ".json") {
      throw Error(Code::invalid_argument,
                  fmt::format("--stats {}: expected a name that ends in .json, or - for standard output",
                              outputs.stats.string()));
    }
    all.push_back(outputs.stats);
  }
  check_all_different(all);
  for (const fs::path& path : all) check_writable(path);
}

void write_pictures(const Outputs& outputs, const Image& image) {
  const auto is_png = [](const fs::path& path) { return ending(path) == ".png"; };
  float exposure_ev = outputs.exposure_ev.value_or(0);
  if (!outputs.exposure_ev && outputs.layer.empty() &&
      std::any_of(outputs.pictures.begin(), outputs.pictures.end(), is_png)) {
    exposure_ev = auto_exposure(image);
    print_result(fmt::format("exposure {:.2f} EV (auto)", exposure_ev));
  }
  std::optional<Error> first_error;
  for (const fs::path& path : outputs.pictures) {
    try {
      if (is_png(path)) {
        write_png(path, outputs, image, exposure_ev);
      } else {
        save_image(path, image);
        print_result(fmt::format("wrote {}", path.string()));
      }
    } catch (const Error& error) {
      if (first_error) print_error(error.what());
      if (!first_error) first_error = error;
    }
  }
  if (first_error) throw Error(*first_error);
}

}  // namespace lightcuts::app
