#include <algorithm>
#include <limits>
#include <vector>

#include "cpu/ism/shadow_map_set.h"
#include "cpu/simd/isa.h"
#include "kernels/shadow_map.h"
#include "lightcuts/image.h"
#include "lightcuts/io.h"
#include "measurements.h"

namespace lightcuts {

/// Draws one VPL's map of 128x128 texels from 1000 points three times, enlarged: as drawn, its holes filled by the study's
/// mean, and by surfaces kept apart; 2 coarser levels. Nearer is darker; texels with nothing are grey.
void draw_map_picture(const BenchScene& bench, std::uint32_t light, const std::string& path) {
  constexpr int size = 128, zoom = 3, gap = 12, panels = 3;
  constexpr int width = panels * size * zoom + (panels - 1) * gap, height = size * zoom;
  const SurfacePoints points(bench.cpu_scene->view(), {1000});
  std::vector<float> values(static_cast<std::size_t>(width) * height, std::numeric_limits<float>::quiet_NaN());
  float farthest = 0;
  for (int panel = 0; panel < panels; ++panel) {
    ShadowMapOptions options;
    options.size = size;
    options.levels = panel == 0 ? 0 : 2;
    options.fill = panel == 1 ? HoleFill::mean : HoleFill::edges;
    ShadowMapSet maps(ism_kernels(selected_isa()), points, bench.lights, options);
    maps.add({{light}, {}, {}});
    const std::vector<std::uint32_t> codes = maps.codes_of(LightKind::vpl, light);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < size * zoom; ++x) {
        const std::uint32_t code = codes[static_cast<std::size_t>(y / zoom * size + x / zoom)];
        if (code == kNoDepth<std::uint16_t>) continue;
        farthest = std::max(farthest, static_cast<float>(code));
        values[static_cast<std::size_t>(y * width + panel * (size * zoom + gap) + x)] = static_cast<float>(code);
      }
    }
  }
  save_png(path, false_colour(width, height, values, 0, farthest).picture);
}

}  // namespace lightcuts
