#pragma once

#include <cstdint>

#include "bench.h"
#include "lightcuts/scene.h"

namespace lightcuts::app::frame {

/// Rays that share nothing: from random points of a scene's surfaces in random directions, asked whether they meet
/// anything.
struct IncoherentRays {
  std::uint32_t count;
  int warm_up, runs;
};

/// Times them on the processor's threads (0: all), of the clock [ms]. The scene must be valid.
Repeats time_on_cpu(int threads, const Scene& scene, const IncoherentRays& rays);

/// The same on a GPU, of the device. Throws Error{not_built} in a build without CUDA.
Repeats time_on_gpu(int device, const Scene& scene, const IncoherentRays& rays);

}  // namespace lightcuts::app::frame
