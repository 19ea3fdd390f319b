#pragma once

namespace lightcuts::bench {

// Each checks its results and registers its benchmarks; throws std::runtime_error if a result is wrong.
void register_pair_sum();
void register_shadow_rays();
void register_threads();

}  // namespace lightcuts::bench
