#include "cpu/ism/kept_maps.h"

#include <algorithm>

namespace lightcuts {
namespace {

bool same_place(const Vpl& a, const Vpl& b) { return a.position == b.position && a.axis == b.axis; }
bool same_place(const PointRecord& a, const PointRecord& b) {
  return a.position == b.position && a.axis == b.axis && (a.cos_outer < 0) == (b.cos_outer < 0);
}
bool same_place(const DirectionalRecord& a, const DirectionalRecord& b) { return a.direction == b.direction; }

/// Lights that stand elsewhere now.
template <class Lights>
std::vector<std::uint32_t> moved(const Lights& from, const Lights& to) {
  std::vector<std::uint32_t> ids;
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (!same_place(from[i], to[i])) ids.push_back(static_cast<std::uint32_t>(i));
  }
  return ids;
}

}  // namespace

const SurfacePoints& KeptMaps::points(const SceneView& scene, const PointOptions& options, StageCounts& counts) {
  if (points_ == nullptr || !(points_->options() == options)) {
    forget();
    points_ = std::make_unique<SurfacePoints>(scene, options);
    ++counts.points;
  }
  return *points_;
}

LightMaps& KeptMaps::for_cuts(const IsmKernels& kernels, const LightSet& lights, const ShadowMapOptions& options,
                              std::size_t room, int threads) {
  for_all_.clear();
  if (for_cuts_ == nullptr || !for_cuts_->serves(options, room)) {
    for_cuts_.reset();
    for_cuts_ = std::make_unique<LightMaps>(kernels, *points_, lights, options, room, threads);
  }
  for_cuts_->begin_picture();
  return *for_cuts_;
}

std::vector<std::unique_ptr<ShadowMapSet>>& KeptMaps::for_all(const IsmKernels& kernels, const LightSet& lights,
                                                              const ShadowMapOptions& options, std::size_t sets) {
  for_cuts_.reset();
  if (for_all_.size() != sets || !(for_all_[0]->maker().options() == options)) {
    for_all_.clear();
    for (std::size_t i = 0; i < sets; ++i) {
      for_all_.push_back(std::make_unique<ShadowMapSet>(kernels, *points_, lights, options));
    }
  }
  return for_all_;
}

void KeptMaps::lights_change(const LightSet& from, const LightSet& to) {
  if (!has_maps()) return;
  if (from.vpls.size() != to.vpls.size() || from.points.size() != to.points.size() ||
      from.directionals.size() != to.directionals.size()) {
    forget_maps();
    return;
  }
  const LightIds ids{moved(from.vpls, to.vpls), moved(from.points, to.points),
                     moved(from.directionals, to.directionals)};
  if (ids.vpls.empty() && ids.points.empty() && ids.directionals.empty()) return;
  for_all_.clear();
  if (for_cuts_ != nullptr) for_cuts_->forget(ids);
}

void KeptMaps::forget_maps() {
  for_cuts_.reset();
  for_all_.clear();
}

void KeptMaps::forget() {
  forget_maps();
  points_.reset();
}

std::uint64_t KeptMaps::bytes() const {
  std::uint64_t sum = points_ == nullptr ? 0 : points_->bytes();
  if (for_cuts_ != nullptr) sum += for_cuts_->bytes();
  for (const auto& set : for_all_) sum += set->bytes();
  return sum;
}

}  // namespace lightcuts
