// Meshes: primitive modes, accessors of every kind, attributes, compression, limits.

#include <gmock/gmock.h>

#include "corpus.h"
#include "gltf_builder.h"

namespace lightcuts {
namespace {

using ::testing::ElementsAre;
using testing::GltfBuilder;
using testing::json;
using testing::make_square;
using testing::warns;

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

Code code_of(const GltfBuilder& builder, const std::string& part) {
  try {
    builder.load();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    return error.code();
  }
  ADD_FAILURE() << "expected an Error about " << part;
  return Code::no_emitter;
}

TEST(Geometry, IndexedTrianglesAsWritten) {
  const LoadedScene loaded = make_square().load();
  ASSERT_EQ(loaded.scene.meshes.size(), 1u);
  const Mesh& mesh = loaded.scene.meshes[0];
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {0, 2, 3}}));
  ASSERT_EQ(mesh.positions.size(), 4u);
  EXPECT_TRUE((mesh.positions[2] == Vec3{1, 1, 0}));
  EXPECT_TRUE(mesh.normals.empty()) << "flat where the file has no normals";
}

TEST(Geometry, StripsTurnEverySecondTriangle) {
  GltfBuilder strip = make_square();
  strip.primitive()["mode"] = 5;
  strip.add_indices({0, 1, 3, 2, 2});
  EXPECT_EQ(strip.load().scene.meshes[0].triangles, (Triangles{{0, 1, 3}, {1, 2, 3}}));
}

TEST(Geometry, FansWithoutIndices) {
  GltfBuilder fan = make_square();
  fan.primitive()["mode"] = 6;
  fan.primitive().erase("indices");
  EXPECT_EQ(fan.load().scene.meshes[0].triangles, (Triangles{{1, 2, 0}, {2, 3, 0}}));
}

TEST(Geometry, PointsAndLinesAreLeftOutWithAWarning) {
  for (int mode = 0; mode < 4; ++mode) {
    GltfBuilder lines = make_square();
    lines.primitive()["mode"] = mode;
    const LoadedScene loaded = lines.load();
    EXPECT_TRUE(loaded.scene.meshes.empty());
    EXPECT_TRUE(warns(loaded, "meshes[0].primitives[0].mode")) << mode;
  }
}

TEST(Geometry, NormalisedAndPlainIntegers) {
  GltfBuilder square = make_square();
  // 16-bit positions, 8 bytes apart.
  const std::vector<std::int16_t> positions{-32768, 0, 0, 0, 32767, 0, 0, 0, 32767, 16384, -5, 0, 0, 0, 0, 0};
  const std::size_t view = square.add_values(positions, 8);
  const std::size_t normalised = square.add_accessor(view, 5122, "VEC3", 4);
  square.root["accessors"][normalised]["normalized"] = true;
  square.primitive()["attributes"]["POSITION"] = normalised;
  Mesh mesh = square.load().scene.meshes[0];
  EXPECT_EQ(mesh.positions[0].x, -1.0f);
  EXPECT_EQ(mesh.positions[1].x, 1.0f);
  EXPECT_NEAR(mesh.positions[2].y, 16384.0 / 32767, 1e-6);
  square.root["accessors"][normalised]["normalized"] = false;
  mesh = square.load().scene.meshes[0];
  EXPECT_EQ(mesh.positions[0].x, -32768.0f);
  EXPECT_EQ(mesh.positions[2].z, -5.0f);
}

TEST(Geometry, InterleavedAttributes) {
  GltfBuilder square = make_square();
  std::vector<float> values;
  for (int i = 0; i < 4; ++i) {
    for (int c = 0; c < 6; ++c) values.push_back(c < 3 ? static_cast<float>(i * 3 + c) : (c == 5 ? 1.0f : 0.0f));
  }
  const std::size_t view = square.add_values(values, 24);
  square.primitive()["attributes"]["POSITION"] = square.add_accessor(view, 5126, "VEC3", 4);
  const std::size_t normals = square.add_accessor(view, 5126, "VEC3", 4);
  square.root["accessors"][normals]["byteOffset"] = 12;
  square.primitive()["attributes"]["NORMAL"] = normals;
  const Mesh mesh = square.load().scene.meshes[0];
  EXPECT_TRUE((mesh.positions[3] == Vec3{9, 10, 11}));
  EXPECT_TRUE((mesh.normals[3] == Vec3{0, 0, 1}));
}

json sparse_at(GltfBuilder& builder, std::uint16_t index, const std::vector<float>& value) {
  return {{"count", 1},
          {"indices", {{"bufferView", builder.add_values(std::vector<std::uint16_t>{index})}, {"componentType", 5123}}},
          {"values", {{"bufferView", builder.add_values(value)}}}};
}

TEST(Geometry, SparseElementsReplaceThoseOfTheView) {
  GltfBuilder square = make_square();
  square.root["accessors"][0]["sparse"] = sparse_at(square, 2, {7, 8, 9});
  const Mesh mesh = square.load().scene.meshes[0];
  EXPECT_TRUE((mesh.positions[2] == Vec3{7, 8, 9}));
  EXPECT_TRUE((mesh.positions[1] == Vec3{1, 0, 0}));
}

TEST(Geometry, SparseElementsAmongZeros) {
  GltfBuilder square = make_square();
  square.root["accessors"][0].erase("bufferView");
  square.root["accessors"][0]["sparse"] = sparse_at(square, 1, {7, 8, 9});
  const Mesh mesh = square.load().scene.meshes[0];
  EXPECT_TRUE((mesh.positions[1] == Vec3{7, 8, 9}));
  EXPECT_TRUE((mesh.positions[0] == Vec3{0, 0, 0}));
}

TEST(Geometry, ZerosWithoutBytesAreLimited) {
  GltfBuilder square = make_square();
  square.primitive() = {{"attributes", {{"POSITION", 0}}}};
  square.root["accessors"][0] = {{"componentType", 5126}, {"type", "VEC3"}, {"count", 3000000000u}};
  EXPECT_EQ(code_of(square, "meshes[0].primitives[0]"), Code::unsupported);
}

TEST(Geometry, ManyMeshesOnOneSmallBufferAreLimited) {
  GltfBuilder square = make_square();
  const std::vector<std::uint8_t> zeros(3 * 999999, 0);
  const std::size_t accessor = square.add_accessor(square.add_values(zeros), 5121, "VEC3", 999999);
  json primitive = {{"attributes", {{"POSITION", accessor}}}};
  square.root["meshes"][0]["primitives"] = json::array();
  for (int i = 0; i < 1000; ++i) square.root["meshes"][0]["primitives"].push_back(primitive);
  EXPECT_EQ(code_of(square, "primitives"), Code::unsupported);
}

TEST(Geometry, VerticesOutOfUseAreNotKept) {
  GltfBuilder square = make_square();
  square.add_attribute("POSITION", "VEC3", 3, std::vector<float>(300, 1.0f));
  square.primitive()["attributes"].erase("TEXCOORD_0");
  square.add_indices({90, 7, 50});
  square.root["accessors"][square.primitive()["attributes"]["POSITION"].get<std::size_t>()]["sparse"] =
      sparse_at(square, 50, {4, 5, 6});
  const Mesh mesh = square.load().scene.meshes[0];
  ASSERT_EQ(mesh.positions.size(), 3u);
  EXPECT_EQ(mesh.triangles, (Triangles{{2, 0, 1}}));
  EXPECT_TRUE((mesh.positions[1] == Vec3{4, 5, 6}));
}

TEST(Geometry, VertexColoursBecomeBytes) {
  GltfBuilder square = make_square();
  square.add_attribute("COLOR_0", "VEC3", 3, {0, 0.5f, 1, 2, -1, 0, 0, 0, 0, 1, 1, 1});
  const Mesh mesh = square.load().scene.meshes[0];
  EXPECT_THAT(mesh.colors[0], ElementsAre(0, 128, 255, 255));
  EXPECT_THAT(mesh.colors[1], ElementsAre(255, 0, 0, 255));
}

TEST(Geometry, MorphTargetsAtTheMeshsWeights) {
  GltfBuilder square = make_square();
  const std::size_t offsets =
      square.add_accessor(square.add_values(std::vector<float>{0, 0, 4, 0, 0, 4, 0, 0, 4, 0, 0, 8}), 5126, "VEC3", 4);
  square.primitive()["targets"] = json::array({{{"POSITION", offsets}}});
  square.root["meshes"][0]["weights"] = json::array({0.5});
  const Mesh mesh = square.load().scene.meshes[0];
  EXPECT_TRUE((mesh.positions[0] == Vec3{0, 0, 2}));
  EXPECT_TRUE((mesh.positions[3] == Vec3{0, 1, 4}));
}

TEST(Geometry, BrokenReferencesNameTheirPlace) {
  GltfBuilder square = make_square();
  square.add_indices({0, 1, 9});
  EXPECT_EQ(code_of(square, "meshes[0].primitives[0].indices: index 9"), Code::malformed);
  square = make_square();
  square.add_attribute("NORMAL", "VEC3", 3, {0, 0, 1});
  EXPECT_EQ(code_of(square, "1 elements for 4 positions"), Code::malformed);
}

Box box_of(const std::string& file) {
  LoadedScene loaded = load_gltf(testing::shared_scenes() / file);
  return scene_bounds(loaded.scene);
}

TEST(Geometry, CompressedBoxesAreBoxes) {
  LC_SKIP_WITHOUT_SHARED_SCENES();
  const Box plain = box_of("gltf/Box/Box.gltf");
  for (const char* file :
       {"gltf/BoxDraco/BoxDraco.gltf", "gltf/BoxMeshopt/BoxMeshopt.gltf", "gltf/BoxMeshopt/BoxMeshopt.glb"}) {
    SCOPED_TRACE(file);
    const Box box = box_of(file);
    EXPECT_LT(length(box.lo - plain.lo), 1e-3f);
    EXPECT_LT(length(box.hi - plain.hi), 1e-3f);
  }
}

TEST(Geometry, QuantizedRoomAgreesWithThePlainOne) {
  LC_SKIP_WITHOUT_SHARED_SCENES();
  const Box plain = box_of("rooms/veach-bidir/scene.gltf");
  for (const char* file :
       {"rooms/veach-bidir/veach-bidir-quantized.glb", "rooms/veach-bidir/veach-bidir-meshopt.glb"}) {
    const Box box = box_of(file);
    EXPECT_LT(length(box.lo - plain.lo), 1e-3f * diagonal(plain)) << file;
    EXPECT_LT(length(box.hi - plain.hi), 1e-3f * diagonal(plain)) << file;
  }
}

}  // namespace
}  // namespace lightcuts
