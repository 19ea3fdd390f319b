// Materials and how they use textures; extensions.

#include <gtest/gtest.h>

#include "gltf_builder.h"
#include "lightcuts/error.h"
#include "png_bytes.h"

namespace lightcuts {
namespace {

using testing::GltfBuilder;
using testing::json;
using testing::make_square;
using testing::png_bytes;
using testing::warns;

GltfBuilder with_material(const char* material) {
  GltfBuilder square = make_square();
  square.root["materials"] = json::array({json::parse(material)});
  square.primitive()["material"] = 0;
  return square;
}

/// A square whose base colour is a picture of 2 x 1 texels with `channels` channels.
GltfBuilder with_texture(const char* material, int channels = 3) {
  GltfBuilder square = with_material(material);
  const std::vector<std::uint8_t> texels(static_cast<std::size_t>(2 * channels), 200);
  square.root["images"] = json::array({{{"bufferView", square.add_view(png_bytes(2, 1, channels, texels))}}});
  square.root["textures"] = json::parse(R"([{"source": 0}, {"source": 0, "sampler": 0}])");
  square.root["samplers"] = json::parse(R"([{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}])");
  return square;
}

TEST(Surface, FactorsAndFlags) {
  const LoadedScene loaded = with_material(R"({"name": "lamp", "doubleSided": true, "emissiveFactor": [1, 0.5, 0],
      "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 10}},
      "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.5, "roughnessFactor": 0.25},
      "alphaMode": "MASK", "alphaCutoff": 0.3})")
                                 .load();
  ASSERT_EQ(loaded.scene.materials.size(), 1u);
  const Material& material = loaded.scene.materials[0];
  EXPECT_EQ(material.name, "lamp");
  EXPECT_TRUE((material.base_color == Vec3{0.1f, 0.2f, 0.3f}));
  EXPECT_FLOAT_EQ(material.alpha, 0.4f);
  EXPECT_TRUE((material.emission == Vec3{10, 5, 0}));
  EXPECT_TRUE(material.double_sided);
  EXPECT_EQ(material.alpha_mode, AlphaMode::mask);
  EXPECT_FLOAT_EQ(material.alpha_cutoff, 0.3f);
  EXPECT_FLOAT_EQ(material.metallic, 0.5f);
  EXPECT_FLOAT_EQ(material.roughness, 0.25f);
  EXPECT_TRUE(warns(loaded, "metalness"));
  EXPECT_TRUE(warns(loaded, "gloss"));
}

TEST(Surface, DefaultMaterialWhereNoneIsNamed) {
  const Scene scene = make_square().load().scene;
  ASSERT_EQ(scene.materials.size(), 1u);
  EXPECT_TRUE((scene.materials[0].base_color == Vec3{1, 1, 1}));
}

TEST(Surface, SpecularGlossinessGivesItsDiffuseColour) {
  const Scene scene = with_material(R"({"extensions": {"KHR_materials_pbrSpecularGlossiness":
      {"diffuseFactor": [0.25, 0.5, 0.75, 1]}}})")
                          .load()
                          .scene;
  EXPECT_TRUE((scene.materials[0].base_color == Vec3{0.25f, 0.5f, 0.75f}));
}

TEST(Surface, OnePictureForTwoTextures) {
  const Scene scene = with_texture(R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
      "emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 1}})")
                          .load()
                          .scene;
  ASSERT_EQ(scene.images.size(), 1u);
  EXPECT_EQ(scene.images[0].width, 2);
  EXPECT_EQ(scene.images[0].channels, 3);
  EXPECT_EQ(scene.materials[0].base_color_texture.image, 0u);
  EXPECT_EQ(scene.materials[0].base_color_texture.wrap_u, Wrap::repeat);
  const TextureRef& emission = scene.materials[0].emission_texture;
  EXPECT_EQ(emission.image, 0u);
  EXPECT_EQ(emission.wrap_u, Wrap::clamp_to_edge);
  EXPECT_EQ(emission.wrap_v, Wrap::mirrored_repeat);
  EXPECT_TRUE(emission.nearest);
  EXPECT_EQ(scene.meshes[0].texcoords[0].size(), 4u);
  EXPECT_TRUE(scene.meshes[0].texcoords[1].empty());
}

TEST(Surface, TextureTransform) {
  const Scene scene = with_texture(R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions":
      {"KHR_texture_transform": {"offset": [0.5, 0.25], "rotation": 1.5707963, "scale": [2, 3]}}}}})")
                          .load()
                          .scene;
  const auto& m = scene.materials[0].base_color_texture.uv_transform;
  // u' = s_v v + 0.5, v' = -s_u u + 0.25: a quarter turn, counter-clockwise as seen with v pointing down.
  const float expected[6] = {0, 3, 0.5f, -2, 0, 0.25f};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(m[i], expected[i], 1e-6f) << i;
}

TEST(Surface, BlendingBecomesAMaskWhereAlphaVaries) {
  const char* material = R"({"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})";
  LoadedScene loaded = with_texture(material, 4).load();
  EXPECT_EQ(loaded.scene.materials[0].alpha_mode, AlphaMode::mask);
  EXPECT_TRUE(warns(loaded, "blended transparency"));
  loaded = with_texture(material, 3).load();
  EXPECT_EQ(loaded.scene.materials[0].alpha_mode, AlphaMode::opaque);
  loaded =
      with_material(R"({"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.2]}})").load();
  EXPECT_EQ(loaded.scene.materials[0].alpha_mode, AlphaMode::mask);
}

TEST(Surface, FilesBesideTheSceneByEncodedNames) {
  for (const char* uri : {"pic%20one%C3%A9.png", "pic one\u00e9.png", "./sub/../pic%20one%c3%a9.png"}) {
    GltfBuilder square = with_texture(R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})");
    square.root["images"] = json::array({{{"uri", uri}}});
    const auto picture = testing::write_file("pic one\u00e9.png", png_bytes(1, 1, 1, {9}));
    std::filesystem::create_directories(picture.parent_path() / "sub");
    const LoadedScene loaded = square.load();
    ASSERT_EQ(loaded.scene.images.size(), 1u) << uri << (loaded.warnings.empty() ? "" : loaded.warnings[0]);
    EXPECT_EQ(loaded.scene.images[0].channels, 1);
  }
}

TEST(Surface, EmbeddedPicture) {
  GltfBuilder square = with_texture(R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})");
  square.root["images"][0] = {{"uri",
                               "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk"
                               "YPhfDwAChwGA60e6kgAAAABJRU5ErkJggg=="}};
  const LoadedScene loaded = square.load();
  ASSERT_EQ(loaded.scene.images.size(), 1u) << loaded.warnings[0];
  EXPECT_EQ(loaded.scene.images[0].channels, 4);
}

TEST(Surface, PicturesThatCannotBeHadAreLeftOut) {
  GltfBuilder square = with_texture(R"({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})");
  for (const char* uri : {"absent.png", "../outside.png", "/etc/hostname", "http://localhost/x.png", "data:,x", "."}) {
    square.root["images"][0] = {{"uri", uri}};
    const LoadedScene loaded = square.load();
    EXPECT_TRUE(loaded.scene.images.empty()) << uri;
    EXPECT_FALSE(loaded.scene.materials[0].base_color_texture.present());
    EXPECT_TRUE(warns(loaded, "images[0]")) << uri;
  }
}

TEST(Surface, ExtensionsAreNamed) {
  GltfBuilder square = make_square();
  square.root["extensionsUsed"] = {"KHR_materials_clearcoat", "X_other", "KHR_texture_transform"};
  const LoadedScene loaded = square.load();
  EXPECT_TRUE(warns(loaded, "KHR_materials_clearcoat is ignored until glossy reflection lands"));
  EXPECT_TRUE(warns(loaded, "X_other"));
  EXPECT_FALSE(warns(loaded, "KHR_texture_transform"));
  square.root["extensionsRequired"] = {"KHR_materials_unlit"};
  EXPECT_NO_THROW(square.load());
  square.root["extensionsRequired"] = {"X_other"};
  EXPECT_THROW(square.load(), Error);
}

}  // namespace
}  // namespace lightcuts
