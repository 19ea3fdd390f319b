#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lightcuts/image.h"
#include "lightcuts/lights.h"
#include "lightcuts/scene.h"

namespace lightcuts {

enum class Method : std::uint8_t { lightcuts, instant_radiosity, path };
enum class Visibility : std::uint8_t { rays, ism, none };
enum class BackendKind : std::uint8_t { automatic, cpu, cuda };
enum class Deposit : std::uint8_t { physical, study };
enum class TreeBuilder : std::uint8_t { agglomerative, ploc, morton };
enum class Metric : std::uint8_t { walter, distance, distance_color, distance_direction, distance_color_direction };
enum class CutWalk : std::uint8_t { heap, packet };
/// How holes of a shadow map are filled: the study's mean of what was drawn nearby, or of the nearest surface there.
enum class HoleFill : std::uint8_t { mean, edges };
/// Which points a shadow map is drawn from: a block of a well-spread order, or the study's noise.
enum class PointChoice : std::uint8_t { block, noise };
enum class Sequence : std::uint8_t { sobol, random };
/// Where VPLs go: where the light goes, or where the camera profits from them.
enum class VplPlacement : std::uint8_t { power, camera };

/// Bounces that mean "until Russian roulette ends it".
inline constexpr int kUnlimitedBounces = std::numeric_limits<int>::max();

/// What the camera sees, for VplPlacement::camera.
struct PlacementView {
  Camera camera;
  int width = 0, height = 0;   ///< [pixels]; only their ratio matters
  float min_distance = 0.01f;  ///< as ShadeOptions has it
};

/// How the scene's light becomes VPLs.
struct VplOptions {
  std::uint64_t count = 10000;       ///< VPLs wanted, those on area lights (a quarter) included; met within 5 %
  std::uint64_t primary_lights = 0;  ///< the study's layout where both are set: N on the lights,
  std::uint64_t vpls_per_light = 0;  ///< each shooting K
  int bounces = kUnlimitedBounces;   ///< reflections of a light path, its last deposit counted; 0: none
  Deposit deposit = Deposit::physical;
  float deposit_distance = 0;  ///< reference distance of Deposit::study [m], > 0
  Sequence sequence = Sequence::sobol;
  VplPlacement placement = VplPlacement::power;
  std::optional<PlacementView> view;  ///< of VplPlacement::camera; `render` fills it in
  std::uint64_t seed = 1;
};

/// How VPLs become a tree.
struct TreeOptions {
  TreeBuilder builder = TreeBuilder::ploc;
  Metric metric = Metric::walter;
  std::uint64_t seed = 1;
};

/// How pixels are lit.
struct ShadeOptions {
  Method method = Method::instant_radiosity;
  Visibility visibility = Visibility::rays;
  float error = 0.02f;        ///< bound on each cut node relative to the pixel's total
  std::uint32_t max_cut = 0;  ///< largest cut, 0: none
  CutWalk cut = CutWalk::packet;
  int ism_size = 64;        ///< texels a side
  int ism_points = 8000;    ///< points splatted a map
  int ism_levels = 2;       ///< coarser levels that fill a map's holes, 0: none
  int ism_depth_bits = 16;  ///< of a texel: 16 or 32
  HoleFill ism_fill = HoleFill::edges;
  PointChoice ism_choice = PointChoice::block;
  float min_distance = 0.01f;       ///< clamp of the VPL singularity, as a fraction of the scene's diagonal
  int samples = 0;                  ///< camera samples a pixel; 0: 1, or 64 for Method::path
  int bounces = kUnlimitedBounces;  ///< of Method::path: bounces + 1 reflections in all
  std::uint64_t seed = 1;
};

/// Everything `render` needs beside the scene.
struct RenderOptions {
  int width = 0;  ///< [pixels], 0: the scene's, else one megapixel of the camera's shape
  int height = 0;
  VplOptions vpls;
  TreeOptions tree;
  ShadeOptions shade;
  BackendKind backend = BackendKind::automatic;
  int device = 0;
  std::uint64_t memory_bytes = 0;  ///< budget of maps and work buffers, 0: three quarters of what is free
  int threads = 0;                 ///< 0: all
};

/// What was done; the members are the `--stats` file's, units in their names.
struct Statistics {
  std::string device;
  struct {
    std::uint64_t triangles = 0, emitters = 0, lights = 0;
  } scene;
  struct {
    std::uint64_t count = 0, primary = 0, paths = 0;
  } vpls;
  struct {
    std::uint64_t nodes = 0, depth = 0;
  } tree;
  struct {
    double mean = 0;
    std::uint64_t max = 0;
    double at_limit = 0;
    std::uint64_t lights_used = 0;
    double gain = 1;  ///< what the light of nodes was multiplied by, so that the mean over the picture is right
  } cut;
  double clamped = 0;  ///< share of the energy that the minimum distance took
  struct {
    std::uint64_t count = 0;
    int size = 0;
    std::uint64_t bytes = 0;   ///< of the maps there were at a time
    std::uint64_t room = 0;    ///< maps at a time that were planned for
    std::uint64_t rounds = 0;  ///< in which maps were made
  } shadow_maps;
  std::uint64_t rays = 0;
  std::uint64_t pairs = 0;  ///< pixel-light pairs evaluated
  struct {
    double load = 0, bvh = 0, vpls = 0, tree = 0, shadow_maps = 0, shade = 0, write = 0, total = 0;
  } time_ms;
  struct {
    std::uint64_t host_peak = 0, device_peak = 0;
  } memory_bytes;
};

/// Told how far a stage is; returns false to stop early. Called from one thread at a time, but not always the same.
/// `done` runs from 0 to 1 within a stage; stages: "bvh", "vpls", "tree", "shadow maps", "shade".
using ProgressFn = std::function<bool(const char* stage, double done)>;

struct RenderResult {
  Image image;  ///< R G B, albedo.*, normal.*, depth.Z; cut.* for lightcuts; `weight` where stopped early
  Statistics statistics;
  std::vector<std::string> warnings;
  bool complete = true;  ///< false where progress asked to stop
};

/// Renders one picture: the whole pipeline.
///
/// The scene must have passed `validate`. The result does not depend on the number of threads.
/// Throws Error{no_emitter, invalid_argument, out_of_memory, no_device, not_built}.
RenderResult render(const Scene& scene, const Camera& camera, const RenderOptions& options,
                    const ProgressFn& progress = {});

}  // namespace lightcuts
