#pragma once

#include <cstdint>
#include <string>

#include "lightcuts/render.h"

namespace lightcuts {

/// What a picture will take beside its scene, known before anything is made [bytes]. Estimates from above, but for
/// shadow maps, which are sized by what is left.
struct MemoryPlan {
  std::uint64_t film = 0;        ///< sums of all planes, and the finished picture
  std::uint64_t lights = 0;      ///< VPLs, and their copy for the inner loops
  std::uint64_t candidates = 0;  ///< of VplPlacement::camera, while they are rated
  std::uint64_t tree = 0;        ///< light trees while they are built

  /// The largest sum at any time.
  [[nodiscard]] std::uint64_t peak() const;
};

MemoryPlan plan_memory(const RenderOptions& options, int width, int height);

/// Throws Error{out_of_memory} that names the largest part and the option that makes it smaller, where the plan does not
/// fit into `budget` [bytes]. 0: no budget.
void require_memory(const MemoryPlan& plan, std::uint64_t budget);

}  // namespace lightcuts
