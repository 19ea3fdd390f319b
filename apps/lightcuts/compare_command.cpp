#include "lightcuts/compare.h"

#include <fmt/format.h>

#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "console.h"
#include "exit_status.h"
#include "lightcuts/error.h"
#include "lightcuts/io.h"
#include "options.h"
#include "values.h"

namespace lightcuts::app {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFooter = R"(
What is printed:
  rmse                   root of the mean squared difference of all channels
  relmse                 mean of (a - b)^2 / (b^2 + 0.01 m^2), m the mean luminance of B
  mean_relative_error    mean of |a - b| / b of luminance; pixels darker than 1 % of m left out
  p99_relative_error     99th percentile of the same
  signed_relative_error  mean of (a - b) / b: above zero where A is brighter
  channel_relative_error (--json) mean of |a - b| / max(b, 0.01 m) of red, green and blue
  flip                   what a person sees when flipping between both: mean LDR-FLIP, 0 to 1, at 67 pixels
                         a degree and the exposure that 'auto' chooses for B

Examples:
  lightcuts compare room.exr reference.exr
  lightcuts compare room.exr reference.exr --max-relmse 0.005 --heatmap difference.png

Exit status: 0 within the limits, 1 past one, 2 wrong usage, 3 images that cannot be compared.)";

struct CompareRequest {
  std::string image, reference;
  bool json = false;
  fs::path heatmap;
  double max_relmse = std::numeric_limits<double>::infinity();
  double max_flip = std::numeric_limits<double>::infinity();
};

void check_heatmap(const CompareRequest& request) {
  if (request.heatmap.empty()) return;
  if (request.heatmap.extension() != ".png") {
    throw Error(Code::invalid_argument,
                fmt::format("--heatmap {}: expected a name that ends in .png", request.heatmap.string()));
  }
  for (const std::string& input : {request.image, request.reference}) {
    std::error_code ignored;
    if (!fs::equivalent(request.heatmap, input, ignored)) continue;
    throw Error(Code::invalid_argument, fmt::format("--heatmap {}: would overwrite an image that is compared; name "
                                                    "another file",
                                                    request.heatmap.string()));
  }
  check_writable(request.heatmap);
}

/// Compares; images that do not fit together are bad input, not wrong usage.
Comparison compare_files(const CompareRequest& request) {
  const Image image = load_image(request.image);
  const Image reference = load_image(request.reference);
  try {
    return compare(image, reference);
  } catch (const Error& error) {
    throw Error(error.code() == Code::invalid_argument ? Code::malformed : error.code(),
                fmt::format("{} against {}: {}", request.image, request.reference, error.what()));
  }
}

void print_comparison(const Comparison& c, bool json) {
  const std::pair<const char*, double> figures[] = {{"rmse", c.rmse},
                                                    {"relmse", c.relmse},
                                                    {"mean_relative_error", c.mean_relative_error},
                                                    {"p99_relative_error", c.p99_relative_error},
                                                    {"signed_relative_error", c.signed_relative_error},
                                                    {"flip", c.flip}};
  if (!json) {
    for (const auto& [name, value] : figures) print_result(fmt::format("{:<22} {:.6g}", name, value));
    return;
  }
  nlohmann::ordered_json out;
  for (const auto& [name, value] : figures) out[name] = value;  // infinity becomes null
  out["channel_relative_error"] = c.channel_relative_error;
  out["exposure_ev"] = c.exposure_ev;
  print_result(out.dump(2));
}

/// True, and one line on stderr, if a figure is above its limit.
bool past_limit(const char* name, double value, double limit) {
  if (value <= limit) return false;
  print_error(fmt::format("{} is {:.6g}, above the limit of {:.6g}", name, value, limit));
  return true;
}

int run(const CompareRequest& request) {
  check_heatmap(request);
  const Comparison result = compare_files(request);
  print_comparison(result, request.json);
  if (!request.heatmap.empty()) {
    const Image size = load_image(request.reference);
    save_png(request.heatmap, false_colour(size.width, size.height, result.flip_map, 0, 1).picture);
    if (!request.json) {
      print_result(fmt::format("wrote {}: FLIP error from 0 (dark violet) to 1 (yellow)", request.heatmap.string()));
    }
  }
  const bool relmse = past_limit("relmse", result.relmse, request.max_relmse);
  const bool flip = past_limit("flip", result.flip, request.max_flip);
  return relmse || flip ? kPastLimit : kDone;
}

}  // namespace

void add_compare_command(CLI::App& program, Action& action) {
  CLI::App* command = program.add_subcommand("compare", "Say how far an image is from a reference");
  command->footer(kFooter);
  auto request = std::make_shared<CompareRequest>();
  constexpr double largest = std::numeric_limits<double>::max();
  command->add_option("A", request->image, "image (.exr, .hdr, .png, .jpg)")->required()->option_text("(required)");
  command->add_option("B", request->reference, "reference, of the same size")->required()->option_text("(required)");
  command->add_flag("--json", request->json, "one JSON object instead of lines");
  add_value(
      *command, "--heatmap", "OUT.png", [request](const std::string& text) { request->heatmap = text; },
      "writes where the FLIP error lies, in false colour");
  add_value(
      *command, "--max-relmse", "X",
      [request](const std::string& text) { request->max_relmse = parse_number(text, 0, largest); },
      "exit status 1 if relmse is above X");
  add_value(
      *command, "--max-flip", "X",
      [request](const std::string& text) { request->max_flip = parse_number(text, 0, largest); },
      "exit status 1 if flip is above X");
  command->callback([request, &action] { action = [request] { return run(*request); }; });
}

}  // namespace lightcuts::app
