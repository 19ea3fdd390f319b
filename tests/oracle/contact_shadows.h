#pragma once

#include <cstdint>
#include <random>

#include "cpu/light_set.h"
#include "cpu/ray_tracer.h"
#include "cpu_core/scene_parts.h"
#include "kernels/offset_point.h"
#include "lightcuts/scene.h"

namespace lightcuts::oracle {

/// Half the width of the box of box_on_floor [m].
inline constexpr float kContactBox = 0.3f;

/// A closed room of 4 x 4 x 2.8 m with a lamp at its ceiling and a box on its floor.
inline Scene box_on_floor() {
  Scene scene;
  const auto grey = test::add_material(scene, {0.6f, 0.6f, 0.6f});
  const auto lamp = test::add_material(scene, {0, 0, 0}, {10, 10, 10});
  test::place(scene, test::box({-2, 0, -2}, {2, 2.8f, 2}, grey, true));
  test::place(scene, test::box({-kContactBox, 0, -kContactBox}, {kContactBox, 2 * kContactBox, kContactBox}, grey));
  test::place(scene, test::quad({-0.4f, 2.79f, -0.4f}, {0.8f, 0, 0}, {0, 0, 0.8f}, lamp));
  return scene;
}

/// Where places beside the edge lie at which the box meets the floor.
enum class ContactSide { floor, box };

/// Calls `use(light, position, normal, visible)` for places `off` metres from that edge which face every `step`-th VPL; `visible`
/// is what a ray says.
template <class Use>
void for_each_contact(const LightSet& lights, const RayTracer& tracer, std::size_t step, float off, ContactSide side,
                      const Use& use) {
  std::mt19937 dice(1);
  std::uniform_real_distribution<float> along(-0.9f * kContactBox, 0.9f * kContactBox);
  for (std::size_t light = 0; light < lights.vpls.size(); light += step) {
    const Vpl& vpl = lights.vpls[light];
    const Vec3 target = offset_point(vpl.position, vpl.axis);
    for (int k = 0; k < 40; ++k) {
      const float sign = k % 4 < 2 ? 1.0f : -1.0f;
      const Vec3 out = k % 2 == 0 ? Vec3{sign, 0, 0} : Vec3{0, 0, sign}, across{out.z, 0, out.x};
      const Vec3 foot = out * kContactBox + across * along(dice);
      const bool floor = side == ContactSide::floor;
      const Vec3 normal = floor ? Vec3{0, 1, 0} : out;
      const Vec3 at = foot + normal * 1e-4f + (floor ? out : Vec3{0, 1, 0}) * off, to_light = target - at;
      if (dot(to_light, vpl.axis) >= 0 || dot(to_light, normal) <= 0) continue;
      use(static_cast<std::uint32_t>(light), at, normal, !tracer.occluded(shadow_ray(at, target)));
    }
  }
}

}  // namespace lightcuts::oracle
