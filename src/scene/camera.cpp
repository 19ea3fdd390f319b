#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "lightcuts/error.h"
#include "lightcuts/scene.h"
#include "scene/limits.h"

namespace lightcuts {

bool is_eye(Vec3 place) {
  return is_finite(place) && std::max({std::fabs(place.x), std::fabs(place.y), std::fabs(place.z)}) <= kFarthestEye;
}

Camera look_at(Vec3 eye, Vec3 target, float vertical_fov_rad) {
  if (!is_eye(eye) || !is_eye(target)) {
    throw Error(Code::invalid_argument,
                fmt::format("the camera's eye and target must lie within {:g} m of the origin", kFarthestEye));
  }
  const Vec3 back = eye - target;
  if (!(length(back) > 0)) {
    throw Error(Code::invalid_argument, "the camera's eye and target must be two different points");
  }
  if (!(vertical_fov_rad > 0 && vertical_fov_rad < kPi)) {
    throw Error(Code::invalid_argument, "the camera's angle of view must lie between 0 and 180 degrees");
  }
  const Vec3 z = normalize(back);
  const bool vertical = std::fabs(z.y) > 0.99999f;
  const Vec3 x = normalize(cross(vertical ? Vec3{0, 0, 1} : Vec3{0, 1, 0}, z));

  Camera camera;
  camera.world_from_camera = {x, normalize(cross(z, x)), z, eye};
  camera.vertical_fov_rad = vertical_fov_rad;
  return camera;
}

}  // namespace lightcuts
