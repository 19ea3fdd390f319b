#include "bench_study/atlas.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "bench_study/cpu_maps.h"
#include "bench_study/gpu_atlas.h"
#include "cpu/ism/fill_holes.h"

namespace lightcuts::app::study {

std::vector<Codes> maps_for_atlas() { return CpuMaps(11).make(0, 121, kStudyPoints, 0, HoleFill::mean); }

Codes make_atlas(const std::vector<Codes>& maps, std::size_t side) {
  constexpr std::size_t kSide = kStudyMapSide;
  const std::size_t width = side * kSide;
  Codes atlas(width * width);
  tbb::parallel_for(std::size_t{0}, side * side, [&](std::size_t i) {
    const Codes& map = maps[i % maps.size()];
    std::uint16_t* corner = atlas.data() + i / side * kSide * width + i % side * kSide;
    for (std::size_t y = 0; y < kSide; ++y) {
      std::copy_n(map.begin() + static_cast<std::ptrdiff_t>(y * kSide), kSide, corner + y * width);
    }
  });
  return atlas;
}

Json time_gpu_pull_push(int device, const std::vector<Codes>& maps, std::size_t side, int repeats) {
  std::vector<Codes> filled = maps;
  FillScratch<std::uint16_t> scratch;
  for (Codes& map : filled) fill_holes(map.data(), kStudyMapSide, kAtlasLevels, HoleFill::mean, scratch);
  return time_gpu_atlas(device, make_atlas(maps, side), make_atlas(filled, side),
                        static_cast<int>(side * kStudyMapSide), repeats);
}

}  // namespace lightcuts::app::study
