#include "render/renderer_promises.h"

#include "cpu_shade/rooms.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

TEST(Renderer, KeepsWhatItSays) {
  for (const Visibility visibility : {Visibility::rays, Visibility::ism}) {
    test::expect_renderer_keeps_what_it_says(lit_room(), room_camera(), BackendKind::cpu, visibility);
    test::expect_renderer_keeps_what_it_says(lit_room(), room_camera(), BackendKind::cpu, visibility, true);
  }
}

TEST(Renderer, LetsVplsFollowTheCamera) {
  test::expect_vpls_follow_the_camera(lit_room(), room_camera(), BackendKind::cpu);
}

TEST(Renderer, RecoversFromWhatWasStoppedAndWhatFailed) {
  test::expect_renderer_recovers(lit_room(), room_camera(), BackendKind::cpu);
}

TEST(Renderer, RefusesDarkScenesAndWrongOptions) {
  Scene scene = lit_room();
  Renderer renderer(scene, test::series_options(BackendKind::cpu, Visibility::none));
  RenderOptions wrong;
  wrong.shade.error = 2;
  EXPECT_THROW(renderer.set_options(wrong), Error);
  for (Material& m : scene.materials) m.emission = {};
  scene.point_lights.clear();
  scene.directional_lights.clear();
  EXPECT_THROW(renderer.lights_changed(), Error);
  EXPECT_THROW(Renderer(scene, {}), Error);
}

}  // namespace
}  // namespace lightcuts
