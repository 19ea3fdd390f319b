#pragma once

#include <vector>

#include "backend/scene_arrays.h"
#include "kernels/emitters.h"

namespace lightcuts {

/// Owns the table of everything that emits. The scene must outlive it.
///
/// A textured triangle's weight is its mean emission, found by sampling its texels, plus one per cent of the texture's
/// own mean: a bright texel between the samples is chosen too seldom, but never never, so nothing is biased.
class EmitterTable {
 public:
  explicit EmitterTable(const SceneArrays& scene);
  EmitterTable(const EmitterTable&) = delete;
  EmitterTable& operator=(const EmitterTable&) = delete;

  [[nodiscard]] const EmitterView& view() const noexcept { return view_; }
  /// Luminance of the flux of the entries [first, last) [W].
  [[nodiscard]] double power(std::uint32_t first, std::uint32_t last) const { return prefix_[last] - prefix_[first]; }
  [[nodiscard]] double total_power() const { return prefix_.back(); }

 private:
  void add_triangles(const SceneArrays& scene);
  void add_punctual_lights(const Scene& scene);
  void add_environment(const Environment& environment);
  double add_environment_image(const Image& image);

  std::vector<double> prefix_;
  std::vector<EmissiveInstance> instances_;
  std::vector<std::uint32_t> first_entry_;
  std::vector<double> rows_, columns_;
  EmitterView view_;
};

}  // namespace lightcuts
