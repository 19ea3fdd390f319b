#pragma once

#include <cmath>

#include "lightcuts/math.h"

namespace lightcuts {

/// The search for the smallest factor by which thresholds have to be raised for a cut that is not larger than allowed.
struct FitSearch {
  float scale = 1;  ///< to be tried
  bool raised = false;

  /// Takes what became of a try; false where `scale` is what was searched.
  LC_KERNEL bool next(bool fits) {
    if (!raised) {
      raised = !fits;
      scale = fits ? 1.0f : above_;
      return raised;
    }
    if (growing_ && !fits && above_ < 1e30f) {
      below_ = above_;
      scale = above_ *= 16;
      return true;
    }
    if (growing_) {
      growing_ = false;
    } else {
      (fits ? above_ : below_) = scale;
    }
    scale = left_ > 0 ? std::sqrt(below_) * std::sqrt(above_) : above_;
    return left_-- > 0;
  }

 private:
  float below_ = 1, above_ = 16;
  bool growing_ = true;
  int left_ = 10;
};

}  // namespace lightcuts
