#include "render/check_options.h"

#include <fmt/format.h>

#include <cmath>

#include "lightcuts/error.h"
#include "scene/limits.h"

namespace lightcuts {
namespace {

constexpr int kLargestSide = 65536;
constexpr std::uint64_t kMostLights = 0xfffffffeu / 2;  // indices of tree nodes are 32 bits
constexpr int kMostSamples = 1 << 24;

template <class T>
void require(bool good, const char* option, T value, const char* expected) {
  if (good) return;
  throw Error(Code::invalid_argument, fmt::format("{} is {}, but must be {}", option, value, expected));
}

void check_size(int width, int height) {
  require(width >= 0 && width <= kLargestSide, "the picture's width", width, "1 to 65536 pixels (0: the scene's)");
  require(height >= 0 && height <= kLargestSide, "the picture's height", height, "1 to 65536 pixels (0: the scene's)");
}

void check_vpls(const VplOptions& vpls) {
  require(vpls.count >= 1 && vpls.count <= kMostLights, "the number of VPLs", vpls.count, "1 to 2147483647");
  require((vpls.primary_lights == 0) == (vpls.vpls_per_light == 0), "the number of VPLs per light", vpls.vpls_per_light,
          "given together with the number of primary lights");
  if (vpls.primary_lights > 0) {
    const bool fits = vpls.primary_lights < kMostLights && vpls.vpls_per_light < kMostLights &&
                      vpls.primary_lights * (vpls.vpls_per_light + 1) <= kMostLights;
    require(fits, "the number of primary lights", vpls.primary_lights,
            "so small that all lights together are at most 2147483647");
  }
  require(vpls.bounces >= 0, "the number of bounces", vpls.bounces, "0 or more");
  if (vpls.deposit == Deposit::study) {
    require(std::isfinite(vpls.deposit_distance) && vpls.deposit_distance > 0, "the deposit distance",
            vpls.deposit_distance, "above 0 m with the study's deposit");
  }
}

void check_shade(const ShadeOptions& shade) {
  require(shade.error > 0 && shade.error < 1, "the error bound", shade.error, "between 0 and 1");
  require(shade.min_distance >= 0 && shade.min_distance <= 1, "the minimum distance", shade.min_distance,
          "0 to 1 (a fraction of the scene's diagonal)");
  require(shade.samples >= 0 && shade.samples <= kMostSamples, "the number of samples", shade.samples,
          "1 to 16777216 (0: the method's)");
  require(shade.bounces >= 0, "the number of bounces", shade.bounces, "0 or more");
  require(shade.ism_size >= 4 && shade.ism_size <= 1024 && (shade.ism_size & (shade.ism_size - 1)) == 0,
          "the size of shadow maps", shade.ism_size, "a power of two from 4 to 1024");
  require(shade.ism_points >= 1, "the number of points a shadow map", shade.ism_points, "1 or more");
  require(shade.ism_levels >= 0 && shade.ism_levels <= 10, "the number of levels that fill a shadow map's holes",
          shade.ism_levels, "0 to 10");
  require(shade.ism_depth_bits == 16 || shade.ism_depth_bits == 32, "the depth of a shadow map's texel",
          shade.ism_depth_bits, "16 or 32 bits");
}

}  // namespace

void check_options(const RenderOptions& options) {
  check_size(options.width, options.height);
  check_vpls(options.vpls);
  check_shade(options.shade);
  require(options.threads >= 0 && options.threads <= 4096, "the number of threads", options.threads,
          "1 to 4096 (0: all)");
  require(options.device >= 0, "the device", options.device, "0 or more");
}

void check_camera(const Camera& camera) {
  const Affine& m = camera.world_from_camera;
  if (!is_eye(m.origin) || !is_finite(m.x) || !is_finite(m.y) || !is_finite(m.z)) {
    throw Error(Code::invalid_argument, fmt::format("the camera's place and axes must be finite numbers, its place "
                                                    "within {:g} m of the origin",
                                                    kFarthestEye));
  }
  const bool perspective = camera.orthographic_height == 0;
  require(!perspective || (camera.vertical_fov_rad > 0 && camera.vertical_fov_rad < kPi), "the camera's angle of view",
          camera.vertical_fov_rad, "between 0 and pi");
  require(camera.orthographic_height >= 0 && camera.orthographic_height <= kFarthestEye,
          "the camera's orthographic height", camera.orthographic_height, "0 (perspective) or above, and finite");
}

}  // namespace lightcuts
