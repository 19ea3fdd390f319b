// Harm done to good files, the same at every run: each mutant loads or is refused with an Error, nothing else.

#include <gtest/gtest.h>

#include <random>
#include <sstream>

#include "corpus.h"
#include "gltf_builder.h"
#include "support/damage.h"

namespace lightcuts {
namespace {

using testing::GltfBuilder;
using testing::json;

using Random = std::mt19937;

std::size_t below(Random& random, std::size_t limit) { return random() % limit; }

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  if (file) bytes << file.rdbuf();
  return bytes.str();
}

/// A .gltf and its .bin as one .glb, so that harm can be done to both.
std::string packed(const std::string& path_without_ending) {
  GltfBuilder builder;
  builder.root = json::parse(bytes_of(path_without_ending + ".gltf"));
  const std::filesystem::path folder = std::filesystem::path(path_without_ending).parent_path();
  builder.binary = bytes_of(folder / builder.root["buffers"][0]["uri"].get<std::string>());
  return builder.glb();
}

/// Mutants made: LC_MUTANTS asks for more than the tests' usual number.
int mutant_count() {
  const char* wish = std::getenv("LC_MUTANTS");
  return wish == nullptr ? 400 : std::atoi(wish);
}

/// A file with most features, and compressed ones of the collection where it is there.
std::vector<std::string> base_files() {
  GltfBuilder rich = testing::make_square();
  rich.add_attribute("NORMAL", "VEC3", 3, {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1});
  rich.add_attribute("COLOR_0", "VEC3", 3, {1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1});
  rich.root["accessors"][0]["sparse"] = {
      {"count", 1},
      {"indices", {{"bufferView", rich.add_values(std::vector<std::uint16_t>{2})}, {"componentType", 5123}}},
      {"values", {{"bufferView", rich.add_values(std::vector<float>{1, 1, 1})}}}};
  rich.root["nodes"] = json::parse(R"([{"mesh": 0, "children": [1, 2]}, {"camera": 0, "translation": [0, 0, 5]},
      {"mesh": 0, "children": [3], "rotation": [0, 0, 0, 1]}, {"scale": [2, 2, 2],
       "extensions": {"KHR_lights_punctual": {"light": 0}}}])");
  rich.root["cameras"] = json::parse(R"([{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}])");
  rich.root["extensions"] = json::parse(R"({"KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": 3,
      "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}}]}})");
  rich.root["materials"] = json::parse(R"([{"emissiveFactor": [1, 1, 1], "alphaMode": "MASK"}])");
  rich.primitive()["material"] = 0;
  std::vector<std::string> files{rich.glb()};
  for (const char* name :
       {"gltf/BoxMeshopt/BoxMeshopt.glb", "gltf/BoxTextured/BoxTextured.glb", "malformed/own-hostile/gltf/ok.gltf"}) {
    if (const std::string bytes = bytes_of(testing::shared_scenes() / name); !bytes.empty()) files.push_back(bytes);
  }
  for (const char* name : {"gltf/BoxDraco/BoxDraco", "gltf/DracoSparseMesh/DracoSparseMesh"}) {
    const std::string path = (testing::shared_scenes() / name).string();
    if (std::filesystem::exists(path + ".gltf")) files.push_back(packed(path));
  }
  return files;
}

void flip_bytes(std::string& file, Random& random) {
  for (std::size_t i = below(random, 8) + 1; i > 0; --i) file[below(random, file.size())] = static_cast<char>(random());
}

void cut(std::string& file, Random& random) { file.resize(below(random, file.size())); }

/// Every number in a JSON value, by address.
void collect_numbers(json& value, std::vector<json*>& numbers) {
  if (value.is_number()) numbers.push_back(&value);
  if (!value.is_structured()) return;
  for (json& child : value) collect_numbers(child, numbers);
}

json absurd_number(Random& random) {
  const json choices[] = {-1,          0,    1,    3,      7,   255,    65536,  2147483648u,
                          4294967295u, 1e18, 1e38, -1e300, 0.5, "text", nullptr};
  return choices[below(random, std::size(choices))];
}

/// Finds the JSON of a .glb or .gltf, lets `change` work on it, and packs it again.
template <class Change>
void change_json(std::string& file, Change&& change) {
  const bool binary = file.starts_with("glTF");
  std::size_t length = file.size();
  if (binary) std::memcpy(&length, file.data() + 12, 4), length &= 0xffffffffu;
  const std::string text = binary ? file.substr(20, length) : file;
  json root = json::parse(text);
  change(root);
  std::string changed = root.dump();
  if (!binary) {
    file = changed;
    return;
  }
  while (changed.size() % 4 != 0) changed += ' ';
  const std::string rest = file.substr(20 + length);
  std::string out = "glTF";
  testing::append_u32(out, 2);
  testing::append_u32(out, 20 + changed.size() + rest.size());
  testing::append_u32(out, changed.size());
  file = out + "JSON" + changed + rest;
}

void change_numbers(std::string& file, Random& random) {
  change_json(file, [&](json& root) {
    std::vector<json*> numbers;
    collect_numbers(root, numbers);
    for (std::size_t i = below(random, 3) + 1; i > 0; --i)
      *numbers[below(random, numbers.size())] = absurd_number(random);
  });
}

void tangle_nodes(std::string& file, Random& random) {
  change_json(file, [&](json& root) {
    json& nodes = root["nodes"];
    json& children = nodes[below(random, nodes.size())]["children"];
    children.push_back(below(random, nodes.size()));
  });
}

void expect_usable(const Scene& scene) {
  for (const Instance& instance : scene.instances) ASSERT_LT(instance.mesh, scene.meshes.size());
  for (const Mesh& mesh : scene.meshes) {
    ASSERT_LT(mesh.material, scene.materials.size());
    for (const auto& triangle : mesh.triangles) {
      for (const std::uint32_t corner : triangle) ASSERT_LT(corner, mesh.positions.size());
    }
  }
}

TEST(Mutants, LoadOrAreRefused) {
  const std::vector<std::string> bases = base_files();
  const int mutants = mutant_count();
  int loaded = 0;
  for (int i = 0; i < mutants; ++i) {
    SCOPED_TRACE(i);
    Random random(static_cast<unsigned>(i));
    std::string file = bases[static_cast<std::size_t>(i) % bases.size()];
    switch ((i / static_cast<int>(bases.size())) % 5) {
      case 0:
        flip_bytes(file, random);
        break;
      case 1:
        cut(file, random);
        break;
      case 2:
        tangle_nodes(file, random);
        break;
      default:
        change_numbers(file, random);
        break;
    }
    const auto path = testing::write_file(file.starts_with("glTF") ? "mutant.glb" : "mutant.gltf", file);
    const test::ModestReading reading;
    const auto outcome = testing::try_load(path);
    testing::show(path, outcome);
    if (!outcome.loaded) {
      EXPECT_NE(outcome.message.find("mutant"), std::string::npos) << outcome.message;
      continue;
    }
    ++loaded;
    expect_usable(outcome.loaded->scene);
  }
  EXPECT_GT(loaded, mutants / 20) << "the mutants are too broken to test anything but the JSON reader";
  EXPECT_LT(loaded, mutants * 19 / 20) << "the mutants are hardly harmed";
}

}  // namespace
}  // namespace lightcuts
