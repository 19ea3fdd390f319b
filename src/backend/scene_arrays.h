#pragma once

#include <vector>

#include "kernels/scene_view.h"
#include "lightcuts/scene.h"

namespace lightcuts {

/// Owns the arrays behind a SceneView. Vertices, triangles and texels stay where the Scene has them, so the scene must
/// outlive this and must not change. It must have passed `validate`.
class SceneArrays {
 public:
  explicit SceneArrays(const Scene& scene);
  SceneArrays(const SceneArrays&) = delete;
  SceneArrays& operator=(const SceneArrays&) = delete;

  /// Reads the scene's materials again, into the same places. Nothing else of the scene may have changed.
  void update_materials();

  [[nodiscard]] const SceneView& view() const noexcept { return view_; }
  [[nodiscard]] const Scene& scene() const noexcept { return *scene_; }

 private:
  const Scene* scene_;
  std::vector<float> linear_from_srgb_;
  std::vector<ImageView> images_;
  std::vector<MaterialView> materials_;
  std::vector<MeshView> meshes_;
  std::vector<InstanceView> instances_;
  SceneView view_;
};

}  // namespace lightcuts
