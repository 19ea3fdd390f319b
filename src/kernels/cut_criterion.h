#pragma once

#include "lightcuts/math.h"

/// The numbers of the criterion that every way of cutting keeps: a node's bound is at most `--error` of the pixel's total.
namespace lightcuts {

/// Thresholds are lowered by this share, so that a recheck in double precision finds the promise kept strictly.
inline constexpr double kThresholdSlack = 1e-4;

/// Share of `--error` that a node's bound may take where shadow rays decide what arrives. The bound takes all light to
/// arrive, and a cluster half in shadow errs by more of its bound than a lit one: with this share, pictures are as near
/// to the sum over all lights with shadows as without (docs/results/cut.md).
inline constexpr float kShadowedShare = 0.6f;

/// Weights by which the luminance of what a receiver reflects follows from the light that it gets; times pi.
LC_FN Vec3 reflected_weights(Vec3 albedo) { return {0.2126f * albedo.x, 0.7152f * albedo.y, 0.0722f * albedo.z}; }

}  // namespace lightcuts
