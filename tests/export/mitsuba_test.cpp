#include <gmock/gmock.h>

#include <cstring>
#include <fstream>
#include <iterator>

#include "export_scenes.h"
#include "lightcuts/export.h"
#include "lightcuts/io.h"

namespace lightcuts::test {
namespace {

using testing::HasSubstr;

std::string content(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Corner `i` of the first triangle of a binary PLY file as PlyWriter lays it out, `stride` floats a vertex.
Vec3 corner(const std::string& ply, std::size_t vertices, std::size_t stride, std::size_t i) {
  const std::size_t body = ply.find("end_header\n") + 11;
  std::uint32_t index = 0;
  std::memcpy(&index, ply.data() + body + vertices * stride * sizeof(float) + 1 + i * sizeof index, sizeof index);
  Vec3 position;
  std::memcpy(&position, ply.data() + body + index * stride * sizeof(float), sizeof position);
  return position;
}

TEST(ExportMitsuba, WritesMeshesInWorldSpaceWithTheirFronts) {
  const ExportFolder folder;
  const Scene scene = scene_of_everything();
  export_scene(folder.file("x.xml"), scene);
  const std::string ply = content(folder.file("x/mesh-2.ply"));
  ASSERT_THAT(ply, HasSubstr("element vertex 4\n"));
  ASSERT_THAT(ply, HasSubstr("property float nx\n"));
  ASSERT_THAT(ply, HasSubstr("property float u\n"));
  ASSERT_THAT(ply, HasSubstr("property float r\n"));
  // The instance mirrors: the front that the library sees must be the front of the file's corners.
  const Affine& place = scene.instances[2].world_from_object;
  const Vec3 a = corner(ply, 4, 11, 0), b = corner(ply, 4, 11, 1), c = corner(ply, 4, 11, 2);
  const Vec3 front = normalize(cross(b - a, c - a)), expected = normalize(transform_normal(place, {0, 0, 1}));
  EXPECT_NEAR(dot(front, expected), 1, 1e-5f);
  EXPECT_EQ(a, transform_point(place, scene.meshes[0].positions[0]));
}

TEST(ExportMitsuba, SaysWhatTheSceneIs) {
  const ExportFolder folder;
  const std::vector<std::string> warnings = export_scene(folder.file("x.xml"), scene_of_everything());
  const std::string xml = content(folder.file("x.xml"));
  for (const char* part : {"type=\"twosided\"", "type=\"diffuse\"", "type=\"area\"", "type=\"point\"", "type=\"spot\"",
                           "type=\"directional\"", "fov_axis\" value=\"y\"", "rfilter type=\"box\"", "type=\"mask\"",
                           "wrap_mode\" value=\"mirror\""}) {
    EXPECT_THAT(xml, HasSubstr(part));
  }
  EXPECT_EQ(warnings.size(), 6u);  // cameras, wraps, vertex colours, masks, two-sided emission, spots
  for (const char* file : {"x/mesh-0.ply", "x/albedo-0.exr", "x/mask-0.exr", "x/emission-1.exr"}) {
    EXPECT_TRUE(std::filesystem::exists(folder.file(file))) << file;
  }
}

TEST(ExportMitsuba, TexturesAreMultipliedInLinearLight) {
  const ExportFolder folder;
  export_scene(folder.file("x.xml"), scene_of_everything());
  const Image albedo = load_image(folder.file("x/albedo-0.exr"));
  EXPECT_NEAR(find_channel(albedo, "R")->values[0], 0.5f, 1e-6f);
  EXPECT_NEAR(find_channel(albedo, "G")->values[1], 0.25f, 1e-6f);
  EXPECT_EQ(find_channel(albedo, "G")->values[0], 0);
}

}  // namespace
}  // namespace lightcuts::test
