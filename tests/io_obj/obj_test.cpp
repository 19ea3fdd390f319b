#include "io/obj.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "support/expect_error.h"
#include "support/shared_scenes.h"
#include "support/temporary_folder.h"

namespace lightcuts {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

/// Writes `text` as an OBJ file, `mtl` as a.mtl beside it, and opens it.
LoadedScene load_text(const std::string& text, const std::string& mtl = "") {
  const TemporaryFolder folder;
  write_whole(folder / "a.obj", text);
  if (!mtl.empty()) write_whole(folder / "a.mtl", mtl);
  save_png(folder / "t.png", {1, 1, {10, 20, 30}});
  fs::create_directory(folder / "maps");
  fs::copy(folder / "t.png", folder / "maps/my texture.png");
  return load_obj(folder / "a.obj");
}

Material load_material(const std::string& mtl) {
  const LoadedScene loaded =
      load_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n", "newmtl m\n" + mtl);
  EXPECT_EQ(loaded.scene.materials.size(), 1u);
  return loaded.scene.materials.at(0);
}

std::size_t triangle_count(const Scene& scene) { return static_cast<std::size_t>(drawn_triangle_count(scene)); }

const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST(Obj, SquareHasSharedCorners) {
  const LoadedScene loaded = load_text(kSquare + "f 1 2 3 4\n");
  EXPECT_THAT(loaded.warnings, IsEmpty());
  ASSERT_EQ(loaded.scene.meshes.size(), 1u);
  const Mesh& mesh = loaded.scene.meshes[0];
  EXPECT_EQ(mesh.positions.size(), 4u);
  EXPECT_EQ(mesh.triangles.size(), 2u);
  EXPECT_TRUE(mesh.normals.empty());
  EXPECT_TRUE(mesh.texcoords[0].empty());
  EXPECT_TRUE(mesh.colors.empty());
  EXPECT_EQ(loaded.scene.materials.size(), 1u);
  EXPECT_EQ(loaded.scene.name, "a");
}

TEST(Obj, CornersAreSharedWherePositionNormalAndTextureCoordinatesAgree) {
  const Mesh mesh =
      load_text(kSquare + "vt 0 0\nvt 1 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf 1/1/1 3/1/1 4/1/1\nf 1/2/1 2/1/1 3/1/1\n")
          .scene.meshes.at(0);
  EXPECT_EQ(mesh.positions.size(), 5u);
  EXPECT_EQ(mesh.triangles.size(), 3u);
  EXPECT_EQ(mesh.normals.size(), 5u);
}

TEST(Obj, TextureCoordinatesPointDown) {
  const Mesh mesh = load_text(kSquare + "vt 0.25 0.125\nf 1/1 2/1 3/1\n").scene.meshes.at(0);
  EXPECT_EQ(mesh.texcoords[0].at(0).x, 0.25f);
  EXPECT_EQ(mesh.texcoords[0].at(0).y, 0.875f);
}

TEST(Obj, IndicesMayCountFromTheEnd) {
  const Mesh mesh = load_text("v 9 9 9\n" + kSquare + "f -4 -3 -2\nv 5 5 5\nf -1 -2 -3\n").scene.meshes.at(0);
  EXPECT_EQ(mesh.positions.at(mesh.triangles.at(0)[0]).x, 0);
  EXPECT_EQ(mesh.positions.at(mesh.triangles.at(1)[0]).x, 5);
}

TEST(Obj, FacesThatLeadNowhereAreLeftOutAndNamed) {
  for (const char* face : {"f 0 1 2", "f 1 2 9", "f 1 2 -9", "f 1 2 99999999999999999999", "f 1 2", "f 1 1 2",
                           "f a b c", "f //1 //1 //1", "f 1.5 2 3", "f 1 2 3x"}) {
    const LoadedScene loaded = load_text(kSquare + "f 1 2 3\n" + face + "\n");
    EXPECT_EQ(triangle_count(loaded.scene), 1u) << face;
    EXPECT_THAT(loaded.warnings, Contains(HasSubstr("a.obj, line 6"))) << face;
  }
}

TEST(Obj, MissingTextureCoordinatesAndNormalsDoNotLoseTheFace) {
  const LoadedScene loaded = load_text(kSquare + "f 1/5/7 2/5/7 3/5/7\n");
  EXPECT_EQ(triangle_count(loaded.scene), 1u);
  EXPECT_TRUE(loaded.scene.meshes.at(0).normals.empty());
  EXPECT_EQ(loaded.warnings.size(), 2u);
}

TEST(Obj, ConcaveAndLargePolygons) {
  const Mesh arrow = load_text("v 0 0 0\nv 2 -1 0\nv 0 3 0\nv -2 -1 0\nf 1 2 3 4\n").scene.meshes.at(0);
  for (const auto& [a, b, c] : arrow.triangles) {
    EXPECT_GT(cross(arrow.positions[b] - arrow.positions[a], arrow.positions[c] - arrow.positions[a]).z, 0);
  }
  // More corners than a byte counts, and a face behind them.
  std::string text, face = "f";
  for (int i = 0; i < 300; ++i) {
    const double angle = 2 * 3.14159265358979 * i / 300;
    text += "v " + std::to_string(std::cos(angle)) + " " + std::to_string(std::sin(angle)) + " 0\n";
    face += " " + std::to_string(i + 1);
  }
  EXPECT_EQ(triangle_count(load_text(text + face + "\nf 1 2 3\n").scene), 299u);
}

TEST(Obj, LineEndsOfEveryKindAndJoinedLines) {
  const std::string text = kSquare + "# comment\n\nf 1 2 3\nf 1 2 \\\n3 4\n";
  for (const char* end : {"\n", "\r\n", "\r"}) {
    std::string other;
    for (const char c : text) other += c == '\n' ? std::string(end) : std::string(1, c);
    const LoadedScene loaded = load_text(other);
    EXPECT_EQ(triangle_count(loaded.scene), 3u);
    EXPECT_THAT(loaded.warnings, IsEmpty());
  }
  EXPECT_EQ(triangle_count(load_text(kSquare + "f 1 2 3").scene), 1u);
  EXPECT_EQ(triangle_count(load_text("\xef\xbb\xbf" + kSquare + "f 1 2 3 # tail").scene), 1u);
  EXPECT_EQ(triangle_count(load_text(kSquare + std::string(3, '\0') + "f 1 2 3").scene), 1u);
}

// Every place of a line end relative to the reader's buffer of 1 MiB.
TEST(Obj, LinesAcrossTheBuffer) {
  for (int shift = 0; shift < 12; ++shift) {
    const std::string comment = "#" + std::string(static_cast<std::size_t>((1 << 20) - 4 - shift), 'x') + "\r\n";
    const LoadedScene loaded = load_text(comment + "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\nf 1 2 9\r\n");
    EXPECT_EQ(triangle_count(loaded.scene), 1u);
    EXPECT_THAT(loaded.warnings, Contains(HasSubstr("line 6:")));
  }
}

TEST(Obj, NumbersOfEveryKind) {
  const LoadedScene loaded =
      load_text("v +1 .5 -2.\nv 1e2 1E+1 1e-400\nv 0x1 1,5 nan\nv 1e400 0 0\nv 3 3 3\nf 1 2 5\nf 1 2 3\nf 1 2 4\n");
  EXPECT_THAT(loaded.warnings, Contains(HasSubstr("line 3: a number is missing, no number, or not finite (4 times")));
  const Mesh& mesh = loaded.scene.meshes.at(0);
  EXPECT_TRUE(mesh.positions.at(0) == (Vec3{1, 0.5f, -2}));
  EXPECT_TRUE(mesh.positions.at(1) == (Vec3{100, 10, 0}));
  Scene scene = loaded.scene;
  validate(scene);
  EXPECT_EQ(triangle_count(scene), 1u);
}

TEST(Obj, OneMeshForEachObjectAndMaterial) {
  const LoadedScene loaded = load_text("mtllib a.mtl\n" + kSquare +
                                           "usemtl r\no one\nf 1 2 3\nusemtl g\nf 1 2 3\nusemtl r\nf 1 3 4\n"
                                           "o two\nf 1 2 3\ng three four\nf 1 2 3\no one\nf 2 3 4\n",
                                       "newmtl r\nKd 1 0 0\nnewmtl g\nKd 0 1 0\n");
  std::map<std::pair<std::string, std::string>, std::size_t> counts;
  for (const Mesh& mesh : loaded.scene.meshes) {
    counts[{mesh.name, loaded.scene.materials.at(mesh.material).name}] += mesh.triangles.size();
  }
  const std::map<std::pair<std::string, std::string>, std::size_t> expected{
      {{"one", "r"}, 3}, {{"one", "g"}, 1}, {{"two", "r"}, 1}, {{"three four", "r"}, 1}};
  EXPECT_EQ(counts, expected);
  EXPECT_EQ(loaded.scene.meshes.size(), 4u);
  EXPECT_EQ(loaded.scene.instances.size(), 4u);
}

// Two squares at a right angle.
const std::string kFold = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 -1\nv 1 1 -1\n";

TEST(Obj, SmoothingGroupsGetMeanNormals) {
  const Mesh mesh = load_text(kFold + "s 1\nf 1 2 3 4\nf 2 5 6 3\n").scene.meshes.at(0);
  EXPECT_EQ(mesh.positions.size(), 6u);
  ASSERT_EQ(mesh.normals.size(), 6u);
  const float half = std::sqrt(0.5f);
  for (std::size_t i = 0; i < 6; ++i) {
    const bool fold = mesh.positions[i].x == 1 && mesh.positions[i].z == 0;
    const Vec3 expected = fold ? Vec3{half, 0, half} : mesh.positions[i].x == 0 ? Vec3{0, 0, 1} : Vec3{1, 0, 0};
    EXPECT_LT(length(mesh.normals[i] - expected), 1e-6f) << i;
  }
}

TEST(Obj, DifferentSmoothingGroupsKeepTheirEdge) {
  const Mesh mesh = load_text(kFold + "s 1\nf 1 2 3 4\ns 2\nf 2 5 6 3\n").scene.meshes.at(0);
  EXPECT_EQ(mesh.positions.size(), 8u);
  EXPECT_TRUE(load_text(kFold + "s 1\ns off\nf 1 2 3 4\nf 2 5 6 3\n").scene.meshes.at(0).normals.empty());
  // Flat and smooth in one mesh: the flat ones get their own.
  const Mesh mixed = load_text(kFold + "s 1\nf 1 2 3 4\ns 0\nf 2 5 6 3\n").scene.meshes.at(0);
  EXPECT_EQ(mixed.normals.size(), mixed.positions.size());
  for (const Mesh* m : {&mesh, &mixed}) {
    for (const Vec3 n : m->normals) EXPECT_TRUE(length(n - Vec3{0, 0, 1}) < 1e-6f || length(n - Vec3{1, 0, 0}) < 1e-6f);
  }
}

TEST(Obj, VertexColorsBecomeLinear) {
  const Mesh mesh = load_text("v 0 0 0 1 0 0.5\nv 1 0 0\nv 0 1 0 1 1 1\nf 1 2 3\n").scene.meshes.at(0);
  ASSERT_EQ(mesh.colors.size(), 3u);
  EXPECT_EQ(mesh.colors[0], (std::array<std::uint8_t, 4>{255, 0, 55, 255}));
  EXPECT_EQ(mesh.colors[1], (std::array<std::uint8_t, 4>{255, 255, 255, 255}));
}

TEST(Mtl, ColoursAndEmission) {
  const Material material = load_material("Kd 0.1 0.2 0.3\r\nKe 10 5 1\r\nPr 0.25\nPm 0.5\n");
  EXPECT_TRUE(material.base_color == (Vec3{0.1f, 0.2f, 0.3f}));
  EXPECT_TRUE(material.emission == (Vec3{10, 5, 1}));
  EXPECT_FALSE(material.double_sided);
  EXPECT_EQ(material.roughness, 0.25f);
  EXPECT_EQ(material.metallic, 0.5f);
  EXPECT_TRUE(load_material("Kd 0.5\n").base_color == (Vec3{0.5f, 0.5f, 0.5f}));
  EXPECT_TRUE(load_material("Ns 1\n").base_color == (Vec3{0.8f, 0.8f, 0.8f}));
}

TEST(Mtl, TexturesWithOptionsSpacesAndBackslashes) {
  const Material plain = load_material("Kd 0.5 0.5 0.5\nmap_Kd t.png\n");
  EXPECT_TRUE(plain.base_color_texture.present());
  EXPECT_TRUE(plain.base_color == (Vec3{0.5f, 0.5f, 0.5f}));
  EXPECT_EQ(plain.base_color_texture.wrap_u, Wrap::repeat);
  for (const char* name :
       {"maps/my texture.png", "maps\\my texture.png", "./maps/../t.png", "/elsewhere/t.png", "..\\t.png"}) {
    EXPECT_TRUE(load_material(std::string("map_Kd -blendu on -mm 0 1 ") + name + "\n").base_color_texture.present())
        << name;
  }
  const Material moved = load_material("map_Ke -s 2 4 1 -o 0.25 0.5 -clamp on t.png\nmap_Kd t.png\nKd 0 0 0\n");
  EXPECT_TRUE(moved.base_color == (Vec3{1, 1, 1}));
  EXPECT_TRUE(moved.emission == (Vec3{1, 1, 1}));
  EXPECT_EQ(moved.emission_texture.wrap_v, Wrap::clamp_to_edge);
  // The file's coordinates (0.5, 0.25) become (2 * 0.5 + 0.25, 4 * 0.25 + 0.5) with v up.
  const auto& m = moved.emission_texture.uv_transform;
  const float u = 0.5f, v = 1 - 0.25f;
  EXPECT_FLOAT_EQ(m[0] * u + m[1] * v + m[2], 1.25f);
  EXPECT_FLOAT_EQ(m[3] * u + m[4] * v + m[5], 1 - 1.5f);
}

TEST(Mtl, OpacityBecomesAMask) {
  EXPECT_EQ(load_material("d 1\n").alpha_mode, AlphaMode::opaque);
  EXPECT_EQ(load_material("d 0.5\n").alpha_mode, AlphaMode::opaque);
  EXPECT_EQ(load_material("d 0.4\n").alpha_mode, AlphaMode::mask);
  EXPECT_EQ(load_material("d 0.4\n").alpha, 0.4f);
  EXPECT_EQ(load_material("Tr 0.75\n").alpha, 0.25f);
  EXPECT_EQ(load_material("Tr 0.75\nd 0.9\n").alpha_mode, AlphaMode::opaque);
  EXPECT_EQ(load_material("d 0.9\nTr 0.75\n").alpha_mode, AlphaMode::opaque);
  const Material cut = load_material("d 0\nmap_d t.png\nmap_Kd t.png\n");
  EXPECT_EQ(cut.alpha_mode, AlphaMode::mask);
  EXPECT_EQ(cut.alpha, 1.0f);
}

TEST(Mtl, OpacityOfAMapBecomesTheAlphaOfTheColour) {
  const LoadedScene loaded = load_text("mtllib a.mtl\n" + kSquare + "usemtl m\nf 1 2 3\n",
                                       "newmtl m\nmap_d t.png\nmap_Kd maps/my texture.png\n");
  const Material& material = loaded.scene.materials.at(0);
  const TextureImage& image = loaded.scene.images.at(material.base_color_texture.image);
  EXPECT_EQ(image.channels, 4);
  EXPECT_EQ(image.texels, (std::vector<std::uint8_t>{10, 20, 30, 10}));
}

TEST(Mtl, WhatIsMissingIsSaidOnce) {
  const LoadedScene loaded =
      load_text("mtllib b.mtl a.mtl\n" + kSquare + "usemtl x\nf 1 2 3\nusemtl m\nf 1 2 3\nusemtl y\nf 1 2 3\n",
                "newmtl m\nKd 1 0 0\nmap_Kd none.png\n");
  EXPECT_THAT(loaded.warnings, Contains(HasSubstr("b.mtl: there is no such material library")));
  EXPECT_THAT(loaded.warnings, Contains(HasSubstr("\"x\" and 1 more is in no material library")));
  EXPECT_THAT(loaded.warnings, Contains(HasSubstr("none.png: there is no such texture")));
  EXPECT_EQ(loaded.warnings.size(), 3u);
  EXPECT_TRUE(loaded.scene.materials.at(1).base_color == (Vec3{1, 0, 0}));
}

TEST(Mtl, NothingOutsideTheFolderIsRead) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "scene");
  write_whole(folder / "secret.mtl", "newmtl m\nKd 1 0 0\n");
  write_whole(folder / "scene/a.obj", "mtllib ../secret.mtl\nmtllib " + (folder / "secret.mtl").string() + "\n" +
                                          kSquare + "usemtl m\nf 1 2 3\n");
  const LoadedScene loaded = load_obj(folder / "scene/a.obj");
  EXPECT_TRUE(loaded.scene.materials.at(0).base_color == (Vec3{0.8f, 0.8f, 0.8f}));
}

TEST(Obj, WhatIsNoSceneIsRefused) {
  expect_error(Code::file_missing, "missing.obj", [] { load_obj("missing.obj"); });
  expect_error(Code::file_missing, "/dev/zero", [] { load_obj("/dev/zero"); });
  expect_error(Code::malformed, "not one line", [] { load_text(""); });
  expect_error(Code::malformed, "not one line", [] { load_text("hello\nworld\n"); });
  EXPECT_EQ(triangle_count(load_text("v 0 0 0\np 1\n").scene), 0u);
}

TEST(SharedObj, AllOpen) {
  LC_SKIP_WITHOUT_SHARED_SCENES();
  int count = 0;
  for (const char* folder : {"obj", "rooms"}) {
    for (const fs::path& path : test::files_below(test::shared_scenes() / folder, {".obj"})) {
      SCOPED_TRACE(path);
      ++count;
      try {
        LoadedScene loaded = load_obj(path);
        validate(loaded.scene);
      } catch (const Error& e) {
        ADD_FAILURE() << e.what();
      }
    }
  }
  EXPECT_GE(count, 80);
}

TEST(SharedObj, SpecialOnesHaveTheExpectedTriangles) {
  LC_SKIP_WITHOUT_SHARED_SCENES();
  const auto load = [](const std::string& name) {
    LoadedScene loaded = load_obj(test::shared_scenes() / "obj" / name);
    validate(loaded.scene);
    return loaded;
  };
  const std::map<std::string, std::size_t> counts{{"tinyobjloader/cube.obj", 12},
                                                  {"tinyobjloader/cube-vertexcol.obj", 12},
                                                  {"tinyobjloader/issue-235-usemtl-then-o.obj", 2},
                                                  {"tinyobjloader/points-prim.obj", 0},
                                                  {"tinyobjloader/line-prim.obj", 0},
                                                  {"tinyobjloader/cornell_box.obj", 36},
                                                  {"assimp/box.obj", 12},
                                                  {"assimp/testmixed.obj", 12},
                                                  {"assimp/point_cloud.obj", 0},
                                                  {"assimp/cube_with_vertexcolors_uni.obj", 12},
                                                  {"assimp/multiple_spaces.obj", 1},
                                                  {"assimp/number_formats.obj", 0}};
  for (const auto& [name, count] : counts) EXPECT_EQ(triangle_count(load(name).scene), count) << name;

  EXPECT_TRUE(load("tinyobjloader/mtl filename with whitespace issue46.obj").scene.materials.at(0).base_color ==
              (Vec3{0, 1, 0}));
  EXPECT_TRUE(load("assimp/space_in_material_name.obj").scene.materials.at(0).base_color ==
              (Vec3{0.141176f, 0.184314f, 0.411765f}));
  EXPECT_FALSE(load("assimp/cube_with_vertexcolors.obj").scene.meshes.at(0).colors.empty());
  EXPECT_FALSE(load("tinyobjloader/smoothing-group-two-squares.obj").scene.meshes.at(0).normals.empty());
}

}  // namespace
}  // namespace lightcuts
