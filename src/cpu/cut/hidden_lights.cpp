#include "cpu/cut/hidden_lights.h"

#include <algorithm>

namespace lightcuts {
namespace {

/// False where the polygon's plane divides no receiver in the box from any light: no smaller box has them divided either.
bool may_be_between(const Occluder& occluder, const Box& receivers, const Box& lights) {
  const Vec3 normal = occluder.normal;
  const float at = dot(normal, occluder.corner[0]);
  const auto lowest = [&](const Box& box) { return dot(normal, detail::box_support(box, normal)) - at; };
  const auto highest = [&](const Box& box) { return dot(normal, detail::box_support(box, -normal)) - at; };
  return (lowest(receivers) < 0 && highest(lights) > 0) || (highest(receivers) > 0 && lowest(lights) < 0);
}

void see_all(const LightSamples& samples, std::vector<std::uint16_t>& left) {
  left.assign((samples.count() + kPacketSize - 1) / kPacketSize, 0xffff);
  if (samples.count() % kPacketSize != 0) {
    left.back() = static_cast<std::uint16_t>((1u << samples.count() % kPacketSize) - 1);
  }
}

}  // namespace

UmbraFinder::UmbraFinder(const CutContext& context, const Frontier& frontier, const CutKernels& kernels,
                         const Box& receivers, const UmbraLimits& limits, UmbraScratch& scratch)
    : context_(context),
      frontier_(frontier),
      kernels_(kernels),
      limits_(limits),
      scratch_(scratch),
      far_lights_(!context.trees.directionals.nodes.empty()) {
  if (!context.trees.vpls.nodes.empty()) lights_ = extend(lights_, context.trees.vpls.nodes[0].box);
  if (!context.trees.points.nodes.empty()) lights_ = extend(lights_, context.trees.points.nodes[0].box);
  scratch.near.clear();
  if (limits.most == 0) return;
  for (std::uint32_t i = 0; i < context.occluders.count; ++i) {
    if (far_lights_ || may_be_between(context.occluders.occluders[i], receivers, lights_)) scratch.near.push_back(i);
  }
}

void UmbraFinder::find(const ReceiverGroup<float>& group) const {
  const OccluderView& view = context_.occluders;
  const Box receivers{group.lo, group.hi};
  const Vec3 middle = center(receivers);
  scratch_.umbras.clear();
  scratch_.candidates.clear();
  for (const std::uint32_t i : scratch_.near) {
    const Occluder& occluder = view.occluders[i];
    if (!far_lights_ && !is_between(occluder, receivers, lights_, view.gap)) continue;
    const float weight = occluder_weight(occluder, middle);
    if (weight >= limits_.least) scratch_.candidates.emplace_back(-weight, i);
  }
  const std::size_t count = std::min<std::size_t>(scratch_.candidates.size(), limits_.most);
  if (count == 0) return;
  std::partial_sort(scratch_.candidates.begin(), scratch_.candidates.begin() + static_cast<std::ptrdiff_t>(count),
                    scratch_.candidates.end());
  see_all(frontier_.places, scratch_.places);
  see_all(frontier_.directions, scratch_.directions);
  for (std::size_t i = 0; i < count; ++i) {
    Umbra umbra;
    if (!find_umbra(view.occluders[scratch_.candidates[i].second], receivers, view.rounding, view.gap, umbra)) continue;
    if (hides_more(umbra)) scratch_.umbras.push_back(umbra);
  }
}

bool UmbraFinder::hides_more(const Umbra& umbra) const {
  const bool place = kernels_.hides_any(umbra, frontier_.places.view(), scratch_.places.data());
  const bool direction = kernels_.hides_any(umbra, frontier_.directions.view(), scratch_.directions.data());
  return place || direction;
}

}  // namespace lightcuts
