#include "cpu/cut/hidden_lights.h"

#include <algorithm>

namespace lightcuts {

void find_umbras(const CutContext& context, const ReceiverGroup<float>& group, std::uint32_t most,
                 UmbraScratch& scratch) {
  scratch.umbras.clear();
  scratch.candidates.clear();
  const OccluderView& view = context.occluders;
  if (view.count == 0 || most == 0) return;
  const Box receivers{group.lo, group.hi};
  Box lights;
  if (!context.trees.vpls.nodes.empty()) lights = extend(lights, context.trees.vpls.nodes[0].box);
  if (!context.trees.points.nodes.empty()) lights = extend(lights, context.trees.points.nodes[0].box);
  const bool far_lights = !context.trees.directionals.nodes.empty();

  const Vec3 middle = center(receivers);
  for (std::uint32_t i = 0; i < view.count; ++i) {
    const Occluder& occluder = view.occluders[i];
    if (!far_lights && !is_between(occluder, receivers, lights, view.gap)) continue;
    scratch.candidates.emplace_back(-occluder_weight(occluder, middle), i);
  }
  const std::size_t count = std::min<std::size_t>(scratch.candidates.size(), most);
  std::partial_sort(scratch.candidates.begin(), scratch.candidates.begin() + static_cast<std::ptrdiff_t>(count),
                    scratch.candidates.end());
  for (std::size_t i = 0; i < count; ++i) {
    Umbra umbra;
    if (!find_umbra(view.occluders[scratch.candidates[i].second], receivers, view.rounding, view.gap, umbra)) continue;
    if (far_lights || touches_box(umbra, lights)) scratch.umbras.push_back(umbra);
  }
}

}  // namespace lightcuts
