#pragma once

#include "lightcuts/lights.h"
#include "lightcuts/render.h"
#include "lightcuts/scene.h"

namespace lightcuts::app::study {

/// Instant Radiosity as a textbook has it: a pixel and a light at a time, plain arithmetic, exact shadow rays.
class ScalarRadiosity {
 public:
  /// `scene` must outlive this.
  explicit ScalarRadiosity(const Scene& scene);
  ~ScalarRadiosity();
  ScalarRadiosity(const ScalarRadiosity&) = delete;
  ScalarRadiosity& operator=(const ScalarRadiosity&) = delete;

  /// A picture by one thread.
  [[nodiscard]] Image render(const Lights& lights, const Camera& camera, int width, int height,
                             const ProgressFn& progress) const;

 private:
  struct Loaded;
  std::unique_ptr<Loaded> loaded_;
};

}  // namespace lightcuts::app::study
