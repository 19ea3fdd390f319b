#pragma once

#include <cstdint>
#include <vector>

#include "bench_study/measure.h"

namespace lightcuts::app::study {

/// Pull-push of an atlas on a GPU: by levels, as the study did, and at once, in one launch; device times.
///
/// Both are first compared with `filled`, what the CPU made of `atlas`. Returns {"levels": times, "at_once": times,
/// "differing": texels}. Throws Error{not_built} in a build without CUDA.
Json time_gpu_atlas(int device, const std::vector<std::uint16_t>& atlas, const std::vector<std::uint16_t>& filled,
                    int side, int repeats);

}  // namespace lightcuts::app::study
