#include "bench_study/cpu_maps.h"

#include "bench_study/rooms.h"
#include "cpu/simd/isa.h"
#include "cpu/vpl_tracer.h"

namespace lightcuts::app::study {

CpuMaps::CpuMaps(std::uint64_t n)
    : scene_(study_room()),
      tracer_(scene_.view()),
      lights_(trace_vpls(scene_, tracer_, study_lights(n))),
      light_set_(make_light_set(lights_)) {}

std::vector<std::vector<std::uint16_t>> CpuMaps::make(std::size_t first, std::size_t count,
                                                      const PointOptions& point_options, int levels,
                                                      HoleFill fill) const {
  ShadowMapOptions options;
  options.size = kStudyMapSide;
  options.levels = levels;
  options.fill = fill;
  const SurfacePoints points(scene_.view(), point_options);
  ShadowMapSet maps(ism_kernels(selected_isa()), points, light_set_, options);
  LightIds ids;
  for (std::size_t i = 0; i < count; ++i) ids.vpls.push_back(static_cast<std::uint32_t>(first + i));
  maps.add(ids);
  std::vector<std::vector<std::uint16_t>> out;
  for (const std::uint32_t light : ids.vpls) {
    const std::vector<std::uint32_t> codes = maps.codes_of(LightKind::vpl, light);
    out.emplace_back(codes.begin(), codes.end());
  }
  return out;
}

}  // namespace lightcuts::app::study
