#include "render/memory_plan.h"

#include <fmt/format.h>

#include <algorithm>

#include "backend/vpl_placement.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

constexpr std::uint64_t kFilmBytes = 160;       ///< a pixel: 80 of sums, 52 of planes, some for writing
constexpr std::uint64_t kLightBytes = 36 + 48;  ///< a VPL and its record
constexpr std::uint64_t kCandidateBytes = 36 + 48 + 4 + 8 + 16 + 4;  ///< and worth, probability, sorting key, order
constexpr std::uint64_t kTreeBytes = 250;                            ///< a light: two nodes and what builders need

std::uint64_t wanted_lights(const VplOptions& o) {
  return o.primary_lights > 0 ? o.primary_lights * (o.vpls_per_light + 1) : o.count;
}

}  // namespace

std::uint64_t MemoryPlan::peak() const { return film + std::max(candidates, lights + tree); }

MemoryPlan plan_memory(const RenderOptions& options, int width, int height) {
  MemoryPlan plan;
  plan.film = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) * kFilmBytes;
  if (options.shade.method == Method::path) return plan;
  const std::uint64_t lights = wanted_lights(options.vpls);
  plan.lights = lights * kLightBytes;
  if (options.vpls.placement == VplPlacement::camera) plan.candidates = placement_candidates(lights) * kCandidateBytes;
  if (options.shade.method == Method::lightcuts) plan.tree = lights * kTreeBytes;
  return plan;
}

void require_memory(const MemoryPlan& plan, std::uint64_t budget) {
  if (budget == 0 || plan.peak() <= budget) return;
  const std::uint64_t by_lights = std::max(plan.candidates, plan.lights + plan.tree);
  const char* remedy = plan.film >= by_lights ? "make the picture smaller (--size)" : "ask for fewer lights (--vpls)";
  throw Error(
      Code::out_of_memory,
      fmt::format("beside the scene, the picture takes {} MiB and the lights take {} MiB, but the memory budget "
                  "is {} MiB; {}, or raise the budget (--memory)",
                  plan.film >> 20, by_lights >> 20, budget >> 20, remedy));
}

}  // namespace lightcuts
