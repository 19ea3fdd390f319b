#pragma once

#include "backend/emitter_table.h"
#include "backend/scene_arrays.h"
#include "cpu/ray_tracer.h"
#include "lightcuts/lights.h"
#include "lightcuts/render.h"

namespace lightcuts {

/// Makes every light of the sum.
///
/// With `count` = N: a quarter samples of area lights and, as directional lights, of the environment, shared by power;
/// the rest VPLs of light paths, whose number a pilot with streams of its own has fixed; where they leave more than 4 %
/// too many, VPLs are dropped at random and the others made up for it. Without bounces all N are samples. With `primary_lights` = N and `vpls_per_light` = K: N samples that shoot K paths each. Punctual lights come
/// on top, all of them, and shoot as well. Path i draws only from stream (options.seed, i), so the result does not
/// depend on the number of threads. N is met within 5 %, but for very small N (below 20, where every kind of emitter
/// gets a sample), emitters whose texture is mostly black, and scenes where almost no path hits anything: the number of
/// paths is bounded at 64 N and fewer VPLs come.
///
/// Where `progress` (stage "vpls") asks to stop, the result is empty.
/// Throws Error{no_emitter, invalid_argument}. Source: Keller 1997; reference section 3.
Lights trace_vpls(const SceneArrays& scene, const RayTracer& tracer, const VplOptions& options,
                  const ProgressFn& progress = {});

/// The same with a table of emitters that exists already.
Lights trace_vpls(const SceneArrays& scene, const EmitterTable& emitters, const RayTracer& tracer,
                  const VplOptions& options, const ProgressFn& progress = {});

}  // namespace lightcuts
