#pragma once

#include <cstdint>
#include <string>

#include "bench_study/study.h"

namespace lightcuts::app::study {

/// Compares a cut in the study's room with the sum over the same lights, which the backend holds with their trees:
/// {"error": their mean difference, "nearer": true where that is large but maps leak, and the cut, which leaves out what
/// large polygons hide, is nearer to shadow rays than the sum}.
///
/// The pictures are so small that the sum takes less than what is timed. null where even that would take too long: on a
/// CPU every light's shadow map is made for it.
Json compare_cut(Study& study, std::uint64_t lights, const ShadeOptions& options);

/// Notes what compare_cut found; nothing where that is null.
void check_cut(Study& study, const std::string& what, const Json& compared);

}  // namespace lightcuts::app::study
