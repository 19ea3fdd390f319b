#pragma once

#include <cstdint>

#include "backend/backend.h"
#include "bench_study/measure.h"
#include "lightcuts/render.h"

namespace lightcuts::app::study {

/// The room that stands for the study's, whose own was not published.
const Scene& study_room();

/// The study's layout: n lights on the lamp, each of which makes n more by one bounce: n + n^2.
VplOptions study_lights(std::uint64_t n, std::uint64_t seed = 1);
inline std::uint64_t light_count(std::uint64_t n) { return n + n * n; }

/// Largest cut of the study's tables.
inline constexpr std::uint32_t kStudyMaxCut = 1000;

/// A picture's options by method and visibility, the rest being the defaults.
ShadeOptions shade_options(Method method, Visibility visibility);

/// Memory that shading may take [bytes].
std::uint64_t memory_budget();

/// How long a stage took: on the device, where the backend measures that (then `device_ms` is above 0), else what `watch`
/// says.
Time stage_time(const Stopwatch& watch, double device_ms);

/// Time of the last picture on the device [ms], of what was made for its shadow maps too; 0 where it was not measured.
double picture_ms(const StageTimes& times);

/// Mean of |a - b| / b of luminance, as `lightcuts compare` has it.
double mean_error(const Image& image, const Image& reference);

}  // namespace lightcuts::app::study
