#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "backend/light_tree.h"

namespace lightcuts {

/// Smallest and largest index of the lights below a node.
struct LightRange {
  std::uint32_t smallest, largest;
};

/// Draws every cluster's representative again: afterwards the tree is the one that assemble_tree makes with this seed, to the
/// bit, whatever was drawn before.
///
/// `scratch` is memory, passed in so that it serves many draws. The same for any number of threads.
void redraw_representatives(LightTree& tree, std::uint64_t seed, std::vector<LightRange>& scratch);

/// Gives each camera sample of a picture other representatives, so that what they are off by averages out over the samples.
/// The first sample has those that the trees were built with, and at the end they have them again.
class DrawPerSample {
 public:
  /// @param seed  that the trees' representatives were drawn with; none: they stay
  DrawPerSample(LightTrees& trees, std::optional<std::uint64_t> seed) : trees_(trees), seed_(seed) {}
  DrawPerSample(const DrawPerSample&) = delete;
  DrawPerSample& operator=(const DrawPerSample&) = delete;
  ~DrawPerSample() { (*this)(0); }

  /// Draws for a sample; returns whether it had to.
  bool operator()(std::uint32_t sample);

 private:
  LightTrees& trees_;
  std::optional<std::uint64_t> seed_;
  std::uint32_t drawn_for_ = 0;
  std::vector<LightRange> scratch_;
};

}  // namespace lightcuts
