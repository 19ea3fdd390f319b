#include "render_request.h"

#include <fmt/format.h>

#include <limits>
#include <tuple>

#include "lightcuts/error.h"
#include "options.h"

namespace lightcuts::app {

const std::vector<Choice<Method>> kMethods{
    {"lightcuts", Method::lightcuts}, {"instant-radiosity", Method::instant_radiosity}, {"path", Method::path}};
const std::vector<Choice<Visibility>> kVisibilities{
    {"rays", Visibility::rays}, {"ism", Visibility::ism}, {"none", Visibility::none}};
const std::vector<Choice<BackendKind>> kBackends{
    {"auto", BackendKind::automatic}, {"cpu", BackendKind::cpu}, {"cuda", BackendKind::cuda}};
const std::vector<Choice<Deposit>> kDeposits{{"physical", Deposit::physical}, {"study", Deposit::study}};
const std::vector<Choice<VplPlacement>> kVplPlacements{{"power", VplPlacement::power},
                                                       {"camera", VplPlacement::camera}};
const std::vector<Choice<TreeBuilder>> kTreeBuilders{
    {"agglomerative", TreeBuilder::agglomerative}, {"ploc", TreeBuilder::ploc}, {"morton", TreeBuilder::morton}};
const std::vector<Choice<Metric>> kMetrics{{"walter", Metric::walter},
                                           {"distance", Metric::distance},
                                           {"distance-color", Metric::distance_color},
                                           {"distance-direction", Metric::distance_direction},
                                           {"distance-color-direction", Metric::distance_color_direction}};
const std::vector<Choice<HoleFill>> kHoleFills{{"mean", HoleFill::mean}, {"edges", HoleFill::edges}};
const std::vector<Choice<PointChoice>> kPointChoices{{"block", PointChoice::block}, {"noise", PointChoice::noise}};
const std::vector<Choice<CutWalk>> kCutWalks{{"heap", CutWalk::heap}, {"packet", CutWalk::packet}};

namespace {

constexpr std::uint64_t kMostLights = 1'000'000'000;
constexpr Method kDefaultMethod = Method::lightcuts;
constexpr std::uint64_t kMostSamples = 1'000'000;

template <class T>
std::string choice_names(const std::vector<Choice<T>>& choices) {
  std::string out;
  for (const Choice<T>& choice : choices) out += (out.empty() ? "" : "|") + std::string(choice.name);
  return out;
}

/// An option whose value is one of several names; the default is what `target` holds now.
template <class T>
CLI::Option* add_choice(CLI::App& command, const std::string& name, T& target, const std::vector<Choice<T>>& choices,
                        const std::string& help) {
  return add_value(
      command, name, choice_names(choices), [&](const std::string& text) { target = parse_choice(text, choices); },
      fmt::format("{} (default: {})", help, name_of(target, choices)));
}

/// A whole number of [lo, hi].
template <class T>
CLI::Option* add_count(CLI::App& command, const std::string& name, const std::string& value, T& target,
                       std::uint64_t lo, std::uint64_t hi, const std::string& help) {
  return add_value(
      command, name, value,
      [&target, lo, hi](const std::string& text) { target = static_cast<T>(parse_count(text, lo, hi)); }, help);
}

CLI::Option* add_number(CLI::App& command, const std::string& name, const std::string& value, float& target, double lo,
                        double hi, const std::string& help) {
  return add_value(
      command, name, value,
      [&target, lo, hi](const std::string& text) { target = static_cast<float>(parse_number(text, lo, hi)); }, help);
}

void add_output_options(CLI::App& command, RenderRequest& request) {
  Outputs& outputs = request.outputs;
  const std::string group = "What is written";
  add_values(
      command, "-o,--output", "PATH", [&](const std::string& text) { outputs.pictures.emplace_back(text); },
      "picture to write; may be given several times. The ending decides:\n"
      ".exr float, all layers; .png tone-mapped for a screen; .hdr float RGB\n"
      "(default: <scene>.exr and <scene>.png in the current folder)")
      ->group(group);
  add_value(
      command, "--layer", "NAME", [&](const std::string& text) { outputs.layer = text; },
      "every .png shows this layer in false colour instead of the picture,\n"
      "e.g. depth.Z, normal.X, albedo.G, cut.size; .exr and .hdr stay as they are")
      ->group(group);
  add_value(
      command, "--exposure", "EV|auto", [&](const std::string& text) { outputs.exposure_ev = parse_exposure(text); },
      "stops by which every .png is made brighter; auto shows the middle\n"
      "tones as middle grey and prints what it chose (default: auto)")
      ->group(group);
  add_value(
      command, "--stats", "FILE.json", [&](const std::string& text) { outputs.stats = text; },
      "writes what was done: counts, times, memory; -: to standard output\n(default: not written)")
      ->group(group);
  command.add_flag("-q,--quiet", request.quiet, "no progress bar; results and warnings stay")->group(group);
}

void add_view_options(CLI::App& command, RenderRequest& request) {
  CameraRequest& camera = request.camera;
  const std::string group = "What is seen";
  add_value(
      command, "--size", "WxH",
      [&](const std::string& text) { std::tie(request.options.width, request.options.height) = parse_size(text); },
      "pixels (default: the scene's, else 1000x1000)")
      ->group(group);
  CLI::Option* name = add_value(
      command, "--camera", "NAME|INDEX", [&](const std::string& text) { camera.which = text; },
      "a camera of the scene; 'lightcuts info' lists them (default: the first,\n"
      "else one that frames the scene from inside or outside)");
  CLI::Option* eye = add_value(
      command, "--eye", "X,Y,Z", [&](const std::string& text) { camera.eye = parse_vector(text); },
      "position of a camera of your own [m]; needs --target");
  CLI::Option* target = add_value(
      command, "--target", "X,Y,Z", [&](const std::string& text) { camera.target = parse_vector(text); },
      "the point it looks at [m]; needs --eye");
  add_value(
      command, "--fov", "DEG",
      [&](const std::string& text) { camera.fov_deg = static_cast<float>(parse_number(text, 0.1, 179)); },
      "vertical angle of view (default: the scene camera's, else 45)")
      ->group(group);
  name->group(group)->excludes(eye)->excludes(target);
  eye->group(group)->needs(target);
  target->group(group)->needs(eye);
  add_value(
      command, "--environment", "COLOR|FILE",
      [&](const std::string& text) {
        static_cast<void>(parse_colour(text));  // refuses a bad colour now; what is none is a file, opened later
        request.environment = text;
      },
      "light from outside: one radiance as R,G,B, one number or '#rrggbb',\n"
      "or an equirectangular .hdr or .exr file (default: the scene's, else none)")
      ->group(group);
}

void add_method_options(CLI::App& command, RenderOptions& options) {
  const std::string group = "How it is lit";
  ShadeOptions& shade = options.shade;
  shade.method = kDefaultMethod;
  add_choice(command, "--method", shade.method, kMethods,
             "a cut through a tree of all lights; all lights for every pixel;\npath-traced reference")
      ->group(group);
  add_choice(command, "--visibility", shade.visibility, kVisibilities,
             "exact shadow rays; imperfect shadow maps; no shadows")
      ->group(group);
  add_count(command, "--samples", "N", shade.samples, 1, kMostSamples,
            "camera samples a pixel (default: 1; for path 64: its paths a pixel)")
      ->group(group);
  add_value(
      command, "--bounces", "B|inf",
      [&options](const std::string& text) { options.vpls.bounces = options.shade.bounces = parse_bounces(text); },
      "reflections of a light path, its last deposit counted; 0: direct light\n"
      "only; inf: until Russian roulette ends it (default: inf)")
      ->group(group);
  add_number(command, "--min-distance", "D", shade.min_distance, 0, 1,
             fmt::format("nearer lights count as if this far, a fraction of the scene's diagonal;\n"
                         "larger: fewer bright spots, darker corners (default: {:g})",
                         shade.min_distance))
      ->group(group);
  add_value(
      command, "--seed", "S",
      [&options](const std::string& text) {
        const std::uint64_t seed = parse_count(text, 0, std::numeric_limits<std::uint64_t>::max());
        options.vpls.seed = options.tree.seed = options.shade.seed = seed;
      },
      "another seed, another noise; the same seed, the same picture (default: 1)")
      ->group(group);
}

void add_vpl_options(CLI::App& command, VplOptions& vpls) {
  const std::string group = "Virtual point lights";
  CLI::Option* count =
      add_count(command, "--vpls", "N", vpls.count, 1, kMostLights,
                fmt::format("lights wanted, a quarter of them on area lights; the scene's point lights\n"
                            "come on top; met within 5 % (default: {})",
                            vpls.count));
  CLI::Option* primary = add_count(command, "--primary-lights", "N", vpls.primary_lights, 1, kMostLights,
                                   "the study's layout instead: N lights on the area lights,");
  CLI::Option* each = add_count(command, "--vpls-per-light", "K", vpls.vpls_per_light, 1, kMostLights,
                                "each of which shoots K, N + N*K in all (default: off)");
  count->group(group)->excludes(primary)->excludes(each);
  primary->group(group)->needs(each);
  each->group(group)->needs(primary);
  add_choice(command, "--vpl-placement", vpls.placement, kVplPlacements,
             "where the light goes; or, of many times more, those that light what the\n"
             "camera sees: for rooms lit through a gap or from next door")
      ->group(group)
      ->excludes(primary)
      ->excludes(each);
  add_choice(command, "--deposit", vpls.deposit, kDeposits,
             "weight of a light: the flux that its path carries; or the study's\ninverse square")
      ->group(group);
  add_number(command, "--deposit-distance", "D", vpls.deposit_distance, 1e-6, 1e6,
             "reference distance of --deposit study [m]")
      ->group(group);
}

void add_cut_options(CLI::App& command, RenderOptions& options) {
  const std::string group = "The cut (--method lightcuts)";
  ShadeOptions& shade = options.shade;
  add_number(command, "--error", "E", shade.error, 1e-6, 0.999,
             fmt::format("bound on each node of the cut, relative to the pixel's total (default: {:g})", shade.error))
      ->group(group);
  add_count(command, "--max-cut", "C", shade.max_cut, 0, kMostLights,
            "largest cut; 0: none, the bound holds everywhere (default: 0)")
      ->group(group);
  add_choice(command, "--tree", options.tree.builder, kTreeBuilders, "how the tree is built")->group(group);
  add_choice(command, "--metric", options.tree.metric, kMetrics, "what makes two lights similar")->group(group);
  add_choice(command, "--cut", shade.cut, kCutWalks, "a priority queue for each pixel; or alike pixels together")
      ->group(group);
}

void add_shadow_map_options(CLI::App& command, ShadeOptions& shade) {
  const std::string group = "Imperfect shadow maps (--visibility ism)";
  add_count(command, "--ism-size", "S", shade.ism_size, 4, 4096,
            fmt::format("texels a side of a map (default: {})", shade.ism_size))
      ->group(group);
  add_count(command, "--ism-points", "P", shade.ism_points, 1, 100'000'000,
            fmt::format("points splatted into a map (default: {})", shade.ism_points))
      ->group(group);
  add_count(command, "--ism-levels", "L", shade.ism_levels, 0, 10,
            fmt::format("coarser levels that fill a map's holes, 0: none (default: {})", shade.ism_levels))
      ->group(group);
  add_choice(command, "--ism-fill", shade.ism_fill, kHoleFills, "a hole takes the study's mean; or that of one surface")
      ->group(group);
  add_choice(command, "--ism-choice", shade.ism_choice, kPointChoices,
             "a block of a well-spread order; or the study's noise")
      ->group(group);
  add_value(
      command, "--ism-depth-bits", "16|32",
      [&shade](const std::string& text) {
        const std::uint64_t bits = parse_count(text, 16, 32);
        if (bits != 16 && bits != 32) throw Error(Code::invalid_argument, "must be 16 or 32, but is " + text);
        shade.ism_depth_bits = static_cast<int>(bits);
      },
      fmt::format("of a texel (default: {})", shade.ism_depth_bits))
      ->group(group);
}

void add_machine_options(CLI::App& command, RenderOptions& options) {
  const std::string group = "The machine";
  add_choice(command, "--backend", options.backend, kBackends, "processor; auto: CUDA where a device answers")
      ->group(group);
  add_count(command, "--device", "N", options.device, 0, 1023, "which CUDA device (default: 0)")->group(group);
  add_count(command, "--threads", "T", options.threads, 1, 4096,
            "threads of the CPU; the picture is the same for any number (default: all)")
      ->group(group);
  add_value(
      command, "--memory", "SIZE", [&options](const std::string& text) { options.memory_bytes = parse_bytes(text); },
      "budget for maps and work buffers, e.g. 512M, 4G, 4GiB\n(default: three quarters of what is free)")
      ->group(group);
}

}  // namespace

void add_render_options(CLI::App& command, RenderRequest& request) {
  command.add_option("SCENE", request.scene, kSceneHelp)->required()->option_text("(required)");
  add_output_options(command, request);
  add_view_options(command, request);
  add_method_options(command, request.options);
  add_vpl_options(command, request.options.vpls);
  add_cut_options(command, request.options);
  add_shadow_map_options(command, request.options.shade);
  add_machine_options(command, request.options);
}

void check_together(const RenderRequest& request) {
  const VplOptions& vpls = request.options.vpls;
  if (vpls.deposit == Deposit::study && vpls.deposit_distance == 0) {
    throw Error(Code::invalid_argument,
                "--deposit study needs its reference distance in metres, e.g. --deposit-distance 1");
  }
  if (vpls.deposit == Deposit::physical && vpls.deposit_distance != 0) {
    throw Error(Code::invalid_argument, "only --deposit study uses --deposit-distance; add that, or leave this out");
  }
}

}  // namespace lightcuts::app
