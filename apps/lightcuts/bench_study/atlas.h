#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bench_study/measure.h"

namespace lightcuts::app::study {

using Codes = std::vector<std::uint16_t>;

/// Two coarser levels, the study's.
inline constexpr int kAtlasLevels = 2;

/// Largest atlas of the study, in maps a side.
inline constexpr std::size_t kStudyAtlas = 31;

/// Depth codes of maps of the study's room, kStudyMapSide texels a side, whose holes are not filled yet.
std::vector<Codes> maps_for_atlas();

/// Maps side by side in one square texture, again and again until `side` times `side` places are taken.
Codes make_atlas(const std::vector<Codes>& maps, std::size_t side);

/// Pull-push of such an atlas on a GPU, as time_gpu_atlas has it, compared with what the processor makes of each map.
Json time_gpu_pull_push(int device, const std::vector<Codes>& maps, std::size_t side, int repeats);

}  // namespace lightcuts::app::study
