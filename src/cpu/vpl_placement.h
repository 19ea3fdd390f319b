#pragma once

#include "backend/scene_arrays.h"
#include "cpu/ray_tracer.h"
#include "lightcuts/lights.h"
#include "lightcuts/render.h"

namespace lightcuts {

/// Keeps those of many candidates that light what the camera sees: options.count VPLs and sky samples (backend/
/// vpl_placement.h). The scene's own punctual lights stay as they are. `options.view` must be set.
///
/// Deterministic whatever the number of threads. Returns false where `progress` asked to stop.
bool place_for_camera(const SceneView& scene, const RayTracer& tracer, const VplOptions& options,
                      const ProgressFn& progress, Lights& lights);

}  // namespace lightcuts
