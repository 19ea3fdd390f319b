#include "cpu/ray_tracer.h"

#include <gtest/gtest.h>

#include <random>

#include "backend/scene_arrays.h"
#include "cpu_core/scene_parts.h"
#include "kernels/surface.h"
#include "math/frame.h"
#include "math/sample_stream.h"
#include "math/warp.h"
#include "oracle/brute_force.h"

namespace lightcuts {
namespace {

/// Forty random triangles, placed three times: shifted, turned and sheared, mirrored. Half of them under an alpha mask.
Scene masked_soup() {
  Scene scene;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> in(-1, 1);
  test::add_material(scene, {0.5f, 0.5f, 0.5f});
  test::add_material(scene, {0.5f, 0.5f, 0.5f});
  TextureImage image;
  image.width = 4;
  image.height = 4;
  image.channels = 4;
  for (int i = 0; i < 16; ++i) {
    for (int c = 0; c < 3; ++c) image.texels.push_back(200);
    image.texels.push_back(random() % 2 == 0 ? 0 : 255);
  }
  scene.images.push_back(image);
  scene.materials[1].alpha_mode = AlphaMode::mask;
  scene.materials[1].base_color_texture.image = 0;
  scene.materials[1].base_color_texture.nearest = true;
  for (std::uint32_t m = 0; m < 2; ++m) {
    Mesh mesh;
    mesh.material = m;
    for (std::uint32_t k = 0; k < 20; ++k) {
      for (int c = 0; c < 3; ++c) {
        mesh.positions.push_back({in(random), in(random), in(random)});
        mesh.texcoords[0].push_back({2 * in(random), 2 * in(random)});
      }
      mesh.triangles.push_back({3 * k, 3 * k + 1, 3 * k + 2});
    }
    scene.meshes.push_back(mesh);
    scene.instances.push_back({"", m, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.5f, 0, 0}}});
    scene.instances.push_back({"", m, {{0, 1, 0.2f}, {-1, 0, 0.3f}, {0, 0.1f, 2}, {-1, 0.5f, 0}}});
    scene.instances.push_back({"", m, {{-1, 0, 0}, {0, 1, 0}, {0, 0, 0.5f}, {0, -1, 1}}});
  }
  return scene;
}

void expect_agrees_with_brute_force(const Scene& scene, std::uint64_t bake_below) {
  const SceneArrays cpu(scene);
  const RayTracer tracer(cpu.view(), bake_below);
  std::mt19937 random(7);
  std::uniform_real_distribution<float> in(-3, 3);
  int hits = 0, misses = 0;
  RayPacket16 packet{};
  std::uint32_t expected_blocked = 0;
  for (int n = 0; n < 4000; ++n) {
    const Ray ray{{in(random), in(random), in(random)}, 0, {in(random), in(random), in(random)}, kInfinity};
    const oracle::Found truth = oracle::intersect(scene, ray.origin, ray.direction);
    const Hit hit = tracer.intersect(ray);
    const bool clear_case = truth.border > 1e-4 && truth.t > 1e-4;  // rounding decides the others
    const bool agrees = truth.instance == hit.instance && (!hit.valid() || truth.triangle == hit.triangle);
    if (clear_case) {
      // A disagreement is a fault unless some other triangle's border or texel edge was grazed in double.
      if (!agrees) ++misses;
      if (agrees && hit.valid()) {
        ++hits;
        EXPECT_NEAR(hit.t, truth.t, 1e-4 * (1 + truth.t));
        EXPECT_NEAR(hit.u, truth.u, 1e-3);
        EXPECT_NEAR(hit.v, truth.v, 1e-3);
      }
    }
    EXPECT_EQ(tracer.occluded(ray), hit.valid());
    const int lane = n % 16;
    packet.ox[lane] = ray.origin.x, packet.oy[lane] = ray.origin.y, packet.oz[lane] = ray.origin.z;
    packet.dx[lane] = ray.direction.x, packet.dy[lane] = ray.direction.y, packet.dz[lane] = ray.direction.z;
    packet.t_min[lane] = 0;
    packet.t_max[lane] = n % 3 == 0 ? kInfinity : 0.5f;
    Ray bounded = ray;
    bounded.t_max = packet.t_max[lane];
    if (tracer.occluded(bounded)) expected_blocked |= 1u << lane;
    if (lane == 15) {
      EXPECT_EQ(tracer.occluded16(packet, 0xffffu), expected_blocked);
      EXPECT_EQ(tracer.occluded16(packet, 0x5a5au), expected_blocked & 0x5a5au);
      expected_blocked = 0;
    }
  }
  EXPECT_GT(hits, 500);
  EXPECT_LE(misses, 2);
}

TEST(RayTracer, AgreesWithBruteForceWhereAllIsBaked) { expect_agrees_with_brute_force(masked_soup(), 1000000); }
TEST(RayTracer, AgreesWithBruteForceThroughInstances) { expect_agrees_with_brute_force(masked_soup(), 0); }

TEST(RayTracer, EmptySceneIsHitByNothing) {
  const Scene scene;
  const SceneArrays cpu(scene);
  const RayTracer tracer(cpu.view());
  const Hit hit = tracer.intersect({{0, 0, 0}, 0, {0, 0, 1}, kInfinity});
  EXPECT_FALSE(hit.valid());
  EXPECT_EQ(hit.t, kInfinity);
  EXPECT_FALSE(tracer.occluded({{0, 0, 0}, 0, {0, 0, 1}, kInfinity}));
}

/// A closed box of `size` metres around a point `away` from the origin, placed by a turned instance.
Scene closed_box(float size, float away, float twist) {
  Scene scene;
  test::add_material(scene, {0.5f, 0.5f, 0.5f});
  const float c = std::cos(twist), s = std::sin(twist);
  const Affine turn{{c, s, 0}, {-s * c, c * c, s}, {s * s, -s * c, c}, {away, -away, 0.5f * away}};
  test::place(scene, test::box({-size / 2, -size / 2, -size / 2}, {size / 2, size / 2, size / 2}, 0, true), turn);
  return scene;
}

/// Walks inside a closed box: a ray that leaves a wall must meet another wall, seen from inside, never its own.
void expect_no_leak(float size, float away, float twist, std::uint64_t bake_below) {
  const Scene scene = closed_box(size, away, twist);
  const SceneArrays cpu(scene);
  const RayTracer tracer(cpu.view(), bake_below);
  const Vec3 middle = scene.instances[0].world_from_object.origin;
  int leaks = 0, self_hits = 0;
  for (std::uint32_t n = 0; n < 3000; ++n) {
    const SampleStream stream{9, n, true};
    Ray ray{middle, 0, sample_sphere(stream.draw(0).unit2(0)), kInfinity};
    for (std::uint32_t step = 0; step < 4; ++step) {
      const Hit hit = tracer.intersect(ray);
      if (!hit.valid()) {
        ++leaks;
        break;
      }
      const TriangleGeometry g = triangle_geometry(cpu.view(), hit.instance, hit.triangle);
      const Surface s = surface_at(cpu.view(), hit, ray.direction);
      if (dot(s.ng, g.front) < 0) ++leaks;  // seen from outside
      if (step > 0 && hit.t < 1e-4f * size && std::fabs(dot(ray.direction, s.ng)) > 0.05f) ++self_hits;
      ray = {s.position, 0, to_world(make_frame(s.ng), sample_cosine_hemisphere(stream.draw(step + 1).unit2(0))),
             kInfinity};
      // The last step leaves by the unmoved point, as a caller without a Surface does.
      if (step == 2) ray.origin = offset_point(point_on_triangle(g, hit.u, hit.v, {0, 0, 0}) + s.ng * g.offset, s.ng);
    }
  }
  EXPECT_EQ(leaks, 0) << "size " << size << " away " << away << " twist " << twist;
  EXPECT_LE(self_hits, 3) << "size " << size << " away " << away << " twist " << twist;
}

TEST(Surface, RaysLeaveWithoutSelfHitsFromMillimetresToKilometres) {
  for (const float size : {1e-3f, 1.0f, 1e3f, 1e6f}) {
    for (const float twist : {0.0f, 0.7f}) {
      expect_no_leak(size, 0, twist, 1000000);
      expect_no_leak(size, 0, twist, 0);
      expect_no_leak(size, 50 * size, twist, 1000000);
      expect_no_leak(size, 50 * size, twist, 0);
    }
  }
}

TEST(Surface, SeesTheSideTheRayCameFrom) {
  Scene scene;
  test::add_material(scene, {0.2f, 0.4f, 0.6f}, {1, 2, 3});
  test::place(scene, test::quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, 0));
  Affine mirror;
  mirror.x = {-1, 0, 0};
  mirror.origin = {10, 0, 0};
  scene.instances.push_back({"", 0, mirror});
  const SceneArrays cpu(scene);
  const RayTracer tracer(cpu.view());
  for (const float x : {0.1f, 10.1f}) {  // the mirrored copy keeps its front towards +z
    const Ray down{{x, 0.2f, 2}, 0, {0, 0, -1}, kInfinity}, up{{x, 0.2f, -2}, 0, {0, 0, 1}, kInfinity};
    const Surface front = surface_at(cpu.view(), tracer.intersect(down), down.direction);
    const Surface back = surface_at(cpu.view(), tracer.intersect(up), up.direction);
    EXPECT_NEAR(front.ng.z, 1, 1e-6);
    EXPECT_NEAR(back.ng.z, -1, 1e-6);
    EXPECT_EQ(front.emission.y, 2);
    EXPECT_EQ(back.emission.y, 0);
    EXPECT_EQ(back.albedo.y, 0.4f);
    EXPECT_GT(front.position.z, 0);
    EXPECT_LT(back.position.z, 0);
    EXPECT_NEAR(front.position.x, x, 1e-5);
  }
}

TEST(Surface, CameraRaysMeetTheCornersOfThePicture) {
  Camera camera = {};
  camera.vertical_fov_rad = kPi / 2;
  const CameraView view = make_camera_view(camera, 200, 100);
  const Ray corner = camera_ray(view, 0, 0), middle = camera_ray(view, 100, 50);
  EXPECT_NEAR(corner.direction.x / corner.direction.z, 2, 1e-5);
  EXPECT_NEAR(corner.direction.y / corner.direction.z, -1, 1e-5);
  EXPECT_NEAR(middle.direction.z, -1, 1e-6);
  camera.orthographic_height = 4;
  const Ray parallel = camera_ray(make_camera_view(camera, 200, 100), 200, 100);
  EXPECT_NEAR(parallel.origin.x, 4, 1e-5);
  EXPECT_NEAR(parallel.origin.y, -2, 1e-5);
  EXPECT_NEAR(parallel.direction.z, -1, 1e-6);
}

}  // namespace
}  // namespace lightcuts
