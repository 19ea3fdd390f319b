#pragma once

#include "kernels/scene_view.h"

namespace lightcuts {

/// A camera with the size of its picture.
struct CameraView {
  Affine world_from_camera;
  float half_width = 1, half_height = 1;  ///< of what is seen: at distance 1 (perspective), or [m] (orthographic)
  bool orthographic = false;
  float width_px = 1, height_px = 1;
};

LC_KERNEL CameraView make_camera_view(const Camera& camera, int width, int height) {
  CameraView view;
  view.world_from_camera = camera.world_from_camera;
  view.orthographic = camera.orthographic_height > 0;
  view.half_height = view.orthographic ? camera.orthographic_height / 2 : std::tan(camera.vertical_fov_rad / 2);
  view.width_px = static_cast<float>(width);
  view.height_px = static_cast<float>(height);
  view.half_width = view.half_height * view.width_px / view.height_px;
  return view;
}

/// Ray through a point of the picture [pixels, from its top left corner]; the direction has unit length.
LC_KERNEL Ray camera_ray(const CameraView& camera, float x_px, float y_px) {
  const float x = (2 * x_px / camera.width_px - 1) * camera.half_width;
  const float y = (1 - 2 * y_px / camera.height_px) * camera.half_height;
  const Affine& m = camera.world_from_camera;
  Ray ray;
  ray.origin = camera.orthographic ? transform_point(m, {x, y, 0}) : m.origin;
  ray.direction = normalize(transform_vector(m, camera.orthographic ? Vec3{0, 0, -1} : Vec3{x, y, -1}));
  return ray;
}

}  // namespace lightcuts
