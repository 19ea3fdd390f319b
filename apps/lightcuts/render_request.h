#pragma once

#include <CLI/CLI.hpp>

#include <optional>
#include <string>

#include "lightcuts/render.h"
#include "outputs.h"
#include "scene_source.h"
#include "values.h"

namespace lightcuts::app {

/// All that `lightcuts render` was asked for.
struct RenderRequest {
  std::string scene;
  Outputs outputs;
  std::optional<std::string> environment;
  CameraRequest camera;
  RenderOptions options;
  bool quiet = false;
};

/// Adds SCENE and every option of `render`, with the library's defaults.
void add_render_options(CLI::App& command, RenderRequest& request);

/// Throws Error{invalid_argument} for options that are good each, but not together.
void check_together(const RenderRequest& request);

// The names that options and statistics use.
extern const std::vector<Choice<Method>> kMethods;
extern const std::vector<Choice<Visibility>> kVisibilities;
extern const std::vector<Choice<BackendKind>> kBackends;
extern const std::vector<Choice<Deposit>> kDeposits;
extern const std::vector<Choice<VplPlacement>> kVplPlacements;
extern const std::vector<Choice<TreeBuilder>> kTreeBuilders;
extern const std::vector<Choice<Metric>> kMetrics;
extern const std::vector<Choice<CutWalk>> kCutWalks;
extern const std::vector<Choice<HoleFill>> kHoleFills;
extern const std::vector<Choice<PointChoice>> kPointChoices;

}  // namespace lightcuts::app
