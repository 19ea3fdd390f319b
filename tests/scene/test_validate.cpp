#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lightcuts/error.h"
#include "make.h"

namespace lightcuts {
namespace {

using test::infinity;
using test::nan;
using test::square_scene;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// The message of the Error{invalid_scene} that validate must throw.
std::string refusal(Scene scene) {
  try {
    validate(scene);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Code::invalid_scene);
    return error.what();
  }
  ADD_FAILURE() << "validate accepted the scene";
  return {};
}

TEST(Validate, LeavesAGoodSceneAlone) {
  Scene scene = square_scene();
  const Vec3* positions = scene.meshes[0].positions.data();
  const auto* triangles = scene.meshes[0].triangles.data();
  EXPECT_THAT(validate(scene), IsEmpty());
  EXPECT_EQ(scene.meshes[0].positions.data(), positions);
  EXPECT_EQ(scene.meshes[0].triangles.data(), triangles);
  EXPECT_EQ(scene.meshes[0].triangles.size(), 2u);
  EXPECT_THAT(validate(*std::make_unique<Scene>()), IsEmpty());
}

// ---- meshes

TEST(ValidateMesh, RemovesTrianglesWithoutAreaAndCountsThem) {
  Scene scene = square_scene();
  scene.meshes[0].triangles.push_back({1, 1, 2});
  scene.meshes[0].triangles.push_back({0, 3, 0});
  scene.meshes[0].positions.push_back({0.5f, 0, 0});
  scene.meshes[0].normals.push_back({0, 0, 1});
  scene.meshes[0].texcoords[0].push_back({});
  scene.meshes[0].triangles.push_back({0, 4, 1});
  EXPECT_THAT(validate(scene),
              ElementsAre(AllOf(HasSubstr("mesh 0 \"square\""), HasSubstr("3 triangles without area"))));
  EXPECT_EQ(scene.meshes[0].triangles.size(), 2u);
}

TEST(ValidateMesh, RemovesTrianglesWithInfiniteCornersAndHidesThePositions) {
  for (const float bad : {nan(), infinity(), -infinity()}) {
    Scene scene = square_scene();
    scene.meshes[0].positions[3].y = bad;
    EXPECT_THAT(validate(scene), ElementsAre(HasSubstr("removed 1 triangle with corners")));
    EXPECT_EQ(scene.meshes[0].triangles.size(), 1u);
    EXPECT_TRUE(is_finite(scene.meshes[0].positions[3]));
  }
}

TEST(ValidateMesh, RefusesHugeCoordinates) {
  Scene scene = square_scene();
  scene.meshes[0].positions[2] = {1e19f, 1e19f, 0};
  EXPECT_THAT(refusal(scene), AllOf(HasSubstr("square"), HasSubstr("1 position beyond")));
  scene = square_scene();
  scene.instances[0].world_from_object.origin = {0, 1e12f, 0};
  EXPECT_THAT(refusal(scene), HasSubstr("instance 0"));
}

TEST(ValidateMesh, RefusesIndicesOutOfRange) {
  Scene scene = square_scene();
  scene.meshes[0].triangles[1][2] = 4;
  EXPECT_THAT(refusal(scene), AllOf(HasSubstr("position 4 in triangle 1"), HasSubstr("has 4 positions")));
  scene = square_scene();
  scene.meshes[0].material = 7;
  EXPECT_THAT(refusal(scene), HasSubstr("material 7"));
  scene = square_scene();
  scene.instances[0].mesh = 1;
  EXPECT_THAT(refusal(scene), HasSubstr("mesh 1"));
}

TEST(ValidateMesh, RefusesCountsThatDoNotMatch) {
  Scene scene = square_scene();
  scene.meshes[0].normals.pop_back();
  EXPECT_THAT(refusal(scene), HasSubstr("4 positions but 3 normals"));
  scene = square_scene();
  scene.meshes[0].texcoords[0].pop_back();
  EXPECT_THAT(refusal(scene), HasSubstr("3 texture coordinates"));
  scene = square_scene();
  scene.meshes[0].texcoords[1].push_back({});
  EXPECT_THAT(refusal(scene), HasSubstr("1 texture coordinates"));
  scene = square_scene();
  scene.meshes[0].colors.push_back({});
  EXPECT_THAT(refusal(scene), HasSubstr("1 colours"));
}

TEST(ValidateMesh, ComputesMissingNormals) {
  Scene scene = square_scene();
  scene.meshes[0].normals[0] = {0, 0, 0};
  scene.meshes[0].normals[2] = {nan(), 0, 1};
  EXPECT_THAT(validate(scene), ElementsAre(HasSubstr("computed 2 normals")));
  EXPECT_EQ(scene.meshes[0].normals[0], (Vec3{0, 0, 1}));
  EXPECT_EQ(scene.meshes[0].normals[2], (Vec3{0, 0, 1}));
}

TEST(ValidateMesh, ComputesANormalWhereBothSidesCancelOut) {
  Scene scene = square_scene();
  scene.meshes[0].triangles = {{0, 1, 2}, {0, 2, 1}};
  scene.meshes[0].normals[1] = {};
  validate(scene);
  EXPECT_NEAR(length(scene.meshes[0].normals[1]), 1, 1e-6);
}

TEST(ValidateMesh, NormalisesWithoutAWord) {
  Scene scene = square_scene();
  scene.meshes[0].normals[0] = {0, 0, 0.97f};
  EXPECT_THAT(validate(scene), IsEmpty());
  EXPECT_NEAR(scene.meshes[0].normals[0].z, 1, 1e-6);
}

TEST(ValidateMesh, RepairsTextureCoordinates) {
  Scene scene = square_scene();
  scene.meshes[0].texcoords[0][1].x = nan();
  scene.meshes[0].texcoords[0][2].y = 1e30f;
  EXPECT_THAT(validate(scene), ElementsAre(HasSubstr("set 2 texture coordinates to zero")));
}

// ---- materials, images

TEST(ValidateMaterial, AddsAMissingOne) {
  Scene scene = square_scene();
  scene.materials.clear();
  EXPECT_THAT(validate(scene), ElementsAre(HasSubstr("no material")));
  ASSERT_EQ(scene.materials.size(), 1u);
  scene.meshes[0].material = kNone;
  EXPECT_THAT(validate(scene), ElementsAre(HasSubstr("no material")));
  EXPECT_EQ(scene.meshes[0].material, 1u);
}

TEST(ValidateMaterial, ClampsColours) {
  Scene scene = square_scene();
  Material& material = scene.materials[0];
  material.base_color = {2, nan(), -1};
  material.emission = {-1, infinity(), nan()};
  material.alpha = 3;
  material.metallic = nan();
  material.roughness = -1;
  material.alpha_cutoff = nan();
  EXPECT_EQ(validate(scene).size(), 6u);
  EXPECT_EQ(material.base_color, (Vec3{1, 0, 0}));
  EXPECT_EQ(material.emission.x, 0);
  EXPECT_TRUE(std::isfinite(material.emission.y));
  EXPECT_EQ(material.emission.z, 0);
  EXPECT_THAT(validate(scene), IsEmpty());
}

TEST(ValidateMaterial, RefusesWrongTextures) {
  Scene scene = square_scene();
  scene.materials[0].base_color_texture.image = 0;
  EXPECT_THAT(refusal(scene), AllOf(HasSubstr("paint"), HasSubstr("image 0")));
  scene.images.push_back({"stone", 2, 2, 3, std::vector<std::uint8_t>(12)});
  EXPECT_THAT(validate(scene), IsEmpty());
  scene.materials[0].base_color_texture.texcoord = 2;
  EXPECT_THAT(refusal(scene), HasSubstr("sets 0 and 1"));
  scene.materials[0].base_color_texture.texcoord = 1;
  scene.materials[0].base_color_texture.uv_transform[2] = nan();
  EXPECT_THAT(validate(scene), ElementsAre(HasSubstr("ignored the transform")));
}

TEST(ValidateImage, RefusesSizesThatDoNotMatchTheTexels) {
  Scene scene = square_scene();
  scene.images.push_back({"stone", 2, 2, 3, std::vector<std::uint8_t>(11)});
  EXPECT_THAT(refusal(scene), AllOf(HasSubstr("stone"), HasSubstr("11 bytes"), HasSubstr("need 12")));
  scene.images[0] = {"stone", 65536, 65536, 1, {}};  // the product is 0 in 32 bits
  EXPECT_THAT(refusal(scene), HasSubstr("stone"));
  scene.images[0] = {"stone", -1, -1, 1, {0}};
  EXPECT_THAT(refusal(scene), HasSubstr("stone"));
  scene.images[0] = {"stone", 1, 1, 5, std::vector<std::uint8_t>(5)};
  EXPECT_THAT(refusal(scene), HasSubstr("5 channels"));
}

// ---- instances

TEST(ValidateInstance, RemovesSingularTransforms) {
  for (const Affine& bad :
       {Affine{{1, 0, 0}, {1, 0, 0}, {0, 0, 1}, {}}, Affine{{1, 0, 0}, {0, 0, 0}, {0, 0, 1}, {}},
        Affine{{nan(), 0, 0}, {0, 1, 0}, {0, 0, 1}, {}}, Affine{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {infinity(), 0, 0}}}) {
    Scene scene = square_scene();
    scene.instances.push_back({"flat", 0, bad});
    EXPECT_THAT(validate(scene), ElementsAre(AllOf(HasSubstr("1 instance"), HasSubstr("flat"))));
    EXPECT_EQ(scene.instances.size(), 1u);
  }
}

TEST(ValidateInstance, KeepsMirrorsAndUnevenScales) {
  Scene scene = square_scene();
  scene.instances.push_back({"", 0, {{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {}}});
  scene.instances.push_back({"", 0, {{1e-3f, 0, 0}, {0, 1e3f, 0}, {0, 0, 1e-3f}, {}}});
  EXPECT_THAT(validate(scene), IsEmpty());
}

// ---- lights

PointLight spot(float cos_inner, float cos_outer) { return {{0, 0, 0}, {1, 1, 1}, {0, -2, 0}, cos_inner, cos_outer}; }

TEST(ValidateLight, RepairsSpots) {
  Scene scene;
  scene.point_lights = {spot(0.9f, 0.8f)};
  EXPECT_THAT(validate(scene), IsEmpty());
  EXPECT_EQ(scene.point_lights[0].axis, (Vec3{0, -1, 0}));
  for (const PointLight& bad : {spot(0.5f, 0.8f), spot(0.8f, 0.8f), spot(1, 1), spot(1, 3), spot(7, 0.5f)}) {
    scene.point_lights = {bad};
    EXPECT_THAT(validate(scene), ElementsAre(HasSubstr("inner cone")));
    EXPECT_GT(scene.point_lights[0].cos_inner, scene.point_lights[0].cos_outer);
    EXPECT_LE(scene.point_lights[0].cos_inner, 1);
  }
  scene.point_lights = {spot(nan(), 0.5f)};
  EXPECT_THAT(refusal(scene), HasSubstr("point light 0"));
  scene.point_lights = {spot(0.9f, 0.8f)};
  scene.point_lights[0].axis = {};
  EXPECT_THAT(refusal(scene), HasSubstr("axis"));
}

TEST(ValidateLight, RemovesDarkOnesAndRefusesLostOnes) {
  Scene scene;
  scene.point_lights.resize(3);
  scene.point_lights[1].intensity = {0, 1, 0};
  scene.directional_lights = {{{0, -1, 0}, {}}, {{0, -3, 0}, {1, 1, 1}}};
  scene.environment = Environment{{0, 0, 0}, nullptr};
  EXPECT_THAT(validate(scene),
              ElementsAre(HasSubstr("2 point lights"), HasSubstr("1 directional light"), HasSubstr("environment")));
  EXPECT_EQ(scene.point_lights.size(), 1u);
  EXPECT_EQ(scene.directional_lights[0].direction, (Vec3{0, -1, 0}));
  EXPECT_FALSE(scene.environment);

  scene.point_lights[0].intensity.x = nan();
  EXPECT_THAT(validate(scene), ElementsAre(HasSubstr("clamped its intensity")));
  scene.point_lights[0].position.z = infinity();
  EXPECT_THAT(refusal(scene), HasSubstr("point light 0"));
  scene.point_lights.clear();
  scene.directional_lights[0].direction = {};
  EXPECT_THAT(refusal(scene), HasSubstr("no direction"));
}

TEST(ValidateLight, CopiesAnEnvironmentOnlyToRepairIt) {
  Scene scene;
  auto image = std::make_shared<Image>(make_rgb_image(2, 1));
  scene.environment = Environment{{1, 1, 1}, image};
  EXPECT_THAT(validate(scene), IsEmpty());
  EXPECT_EQ(scene.environment->image, image);
  image->channels[0].values = {nan(), infinity()};
  EXPECT_THAT(validate(scene), ElementsAre(HasSubstr("clamped 2 values")));
  EXPECT_TRUE(std::isfinite(scene.environment->image->channels[0].values[1]));
  EXPECT_TRUE(std::isnan(image->channels[0].values[0])) << "the caller's picture must not change";
  image->channels.pop_back();
  scene.environment->image = image;
  EXPECT_THAT(refusal(scene), HasSubstr("plane B"));
}

// ---- cameras

TEST(ValidateCamera, RepairsWhatItCan) {
  Scene scene;
  scene.width = -3;
  scene.cameras.resize(2);
  Camera& camera = scene.cameras[0];
  camera.name = "eye";
  camera.world_from_camera = {{-2, 0, 0}, {0, 2, 0.5f}, {0, 0, 2}, {1, 2, 3}};
  camera.vertical_fov_rad = nan();
  camera.orthographic_height = -1;
  camera.aspect = infinity();
  scene.cameras[1].world_from_camera.y = {0, 0, 1};
  const auto warnings = validate(scene);
  EXPECT_THAT(warnings, ElementsAre(AllOf(HasSubstr("camera 0 \"eye\""), HasSubstr("orthonormal")),
                                    HasSubstr("angle of view"), HasSubstr("orthographic"), HasSubstr("aspect"),
                                    HasSubstr("Removed camera 1"), HasSubstr("picture size")));
  ASSERT_EQ(scene.cameras.size(), 1u);
  const Affine m = scene.cameras[0].world_from_camera;
  EXPECT_NEAR(determinant(m), 1, 1e-5);
  EXPECT_EQ(m.z, (Vec3{0, 0, 1}));
  EXPECT_EQ(m.origin, (Vec3{1, 2, 3}));
  EXPECT_EQ(scene.width, 0);
  EXPECT_THAT(validate(scene), IsEmpty());
}

}  // namespace
}  // namespace lightcuts
