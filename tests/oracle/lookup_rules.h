#pragma once

#include <cmath>

#include "kernels/shadow_map.h"

namespace lightcuts::oracle {

/// How much each of the five taps counts.
enum class TapWeights {
  even,    ///< a fifth
  middle,  ///< the receiver's texel alone
  heavy,   ///< a half for the receiver's texel, an eighth for each other
  linear,  ///< by the receiver's place between the centres of texels
  two      ///< the same of its own texel and the nearest one beside it
};

/// Rules of a lookup to compare, of which lookup_visibility is one: how far in front of the receiver an occluder must be to count,
/// and how much the taps count.
struct LookupRule {
  const char* name;
  TapWeights weights = TapWeights::even;
  float middle = kBiasTexels;      ///< of the receiver's own texel, in texels' widths at the receiver
  float outer = kBiasTexels;       ///< of the four others
  float outer_dark = kBiasTexels;  ///< the same where the receiver's own texel lets no light pass
  bool by_height = false;          ///< theirs is a height above the receiver's plane, not a way along the ray
};

/// lookup_visibility by another rule.
template <class Depth, class Fetch>
float look_up_by(const LookupRule& rule, const MapView& view, Vec3 local, Vec3 normal, int size, const Fetch& fetch) {
  const bool paraboloid = view.half_width == 0;
  const float texel = 2.0f / static_cast<float>(size), step = view.far / kDepthSteps<Depth>;
  TapPlane<float> plane = paraboloid ? tap_plane_paraboloid(local, normal, texel, step)
                                     : tap_plane_orthographic(local, normal, view.half_width, texel, step);
  const float width = (plane.bias - step) / kBiasTexels;  // of a texel at the receiver
  const float last = static_cast<float>(size - 1), half = 0.5f * static_cast<float>(size);
  const int x = static_cast<int>(clamp_to((plane.at.u + 1) * half, 0.0f, last));
  const int y = static_cast<int>(clamp_to((plane.at.v + 1) * half, 0.0f, last));
  const auto passes = [&](int tap, float bias) {
    const int i = clamp_to(x + tap_x(tap), 0, size - 1), j = clamp_to(y + tap_y(tap), 0, size - 1);
    const Depth code = fetch(i, j);
    if (code == kNoDepth<Depth>) return 1.0f;
    plane.bias = step + bias * width;
    return tap_passes(plane, texel_centre(i, size), texel_centre(j, size), static_cast<float>(code) * step, paraboloid);
  };
  const float middle = passes(0, rule.middle);
  if (rule.weights == TapWeights::middle) return middle;
  float outer = middle == 0 ? rule.outer_dark : rule.outer;
  if (rule.by_height) {
    const float facing = paraboloid ? dot(local, normal) * plane.inverse : normal.z;
    outer /= std::abs(away_from_zero(facing));
  }
  // From the texel's centre, in texels.
  float right = clamp_to((plane.at.u - texel_centre(x, size)) * half, -0.5f, 0.5f);
  float up = clamp_to((plane.at.v - texel_centre(y, size)) * half, -0.5f, 0.5f);
  float sum = 0, left_over = 1;
  for (int tap = 1; tap < kTaps; ++tap) {
    float weight = rule.weights == TapWeights::even ? 1.0f / kTaps : 0.125f;
    if (rule.weights == TapWeights::two && std::abs(right) > std::abs(up)) up = 0;
    if (rule.weights == TapWeights::two && std::abs(up) > std::abs(right)) right = 0;
    if (rule.weights == TapWeights::linear || rule.weights == TapWeights::two) {
      weight = max_of(0.0f, right * static_cast<float>(tap_x(tap)) + up * static_cast<float>(tap_y(tap)));
    }
    if (weight == 0) continue;
    sum += weight * passes(tap, outer);
    left_over -= weight;
  }
  return sum + left_over * middle;
}

}  // namespace lightcuts::oracle
