// Where the time of opening a scene goes, and how much memory it takes: a Markdown row a file.
//
// "Read" is reading the file's bytes and nothing else; "decode" is what load_gltf takes beyond that; "copy" is what one
// copy of the finished scene's arrays costs, the yardstick for copying of our own; then validation and the BVH.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "backend/scene_arrays.h"
#include "cpu/ray_tracer.h"
#include "io/gltf.h"
#include "lightcuts/io.h"
#include "render/memory.h"

namespace lightcuts {
namespace {

namespace fs = std::filesystem;

/// A wavy grid of two triangles a cell with normals and texture coordinates, as one binary glTF file.
class GridFile {
 public:
  GridFile(const fs::path& path, std::uint64_t triangles) : path_(path) {
    const auto side = static_cast<std::uint32_t>(std::ceil(std::sqrt(static_cast<double>(triangles) / 2)));
    const std::uint32_t row = side + 1, vertices = row * row;
    nlohmann::json gltf{{"asset", {{"version", "2.0"}}},       {"scene", 0},
                        {"scenes", {{{"nodes", {0}}}}},        {"nodes", {{{"mesh", 0}}}},
                        {"buffers", {{{"byteLength", 0}}}},    {"bufferViews", nlohmann::json::array()},
                        {"accessors", nlohmann::json::array()}};
    std::string bytes;
    const auto add = [&](const auto& values, int type, const char* shape, std::size_t count) {
      const std::size_t size = values.size() * sizeof(values[0]);
      gltf["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", size}});
      gltf["accessors"].push_back(
          {{"bufferView", gltf["bufferViews"].size() - 1}, {"componentType", type}, {"count", count}, {"type", shape}});
      bytes.append(reinterpret_cast<const char*>(values.data()), size);
      return gltf["accessors"].size() - 1;
    };
    std::vector<float> positions, normals, texcoords;
    for (std::uint32_t i = 0; i < vertices; ++i) {
      const float u = static_cast<float>(i % row) / static_cast<float>(side);
      const float v = static_cast<float>(i / row) / static_cast<float>(side);
      positions.insert(positions.end(), {u * 100, std::sin(u * 60) * std::sin(v * 60), v * 100});
      normals.insert(normals.end(), {0, 1, 0});
      texcoords.insert(texcoords.end(), {u, v});
    }
    std::vector<std::uint32_t> corners;
    for (std::uint32_t q = 0; q < side * side; ++q) {
      const std::uint32_t a = q / side * row + q % side;
      corners.insert(corners.end(), {a, a + row, a + 1, a + 1, a + row, a + row + 1});
    }
    const nlohmann::json attributes{{"POSITION", add(positions, 5126, "VEC3", vertices)},
                                    {"NORMAL", add(normals, 5126, "VEC3", vertices)},
                                    {"TEXCOORD_0", add(texcoords, 5126, "VEC2", vertices)}};
    gltf["accessors"][0]["min"] = {0, -1, 0};
    gltf["accessors"][0]["max"] = {100, 1, 100};
    gltf["meshes"] = {
        {{"primitives", {{{"attributes", attributes}, {"indices", add(corners, 5125, "SCALAR", corners.size())}}}}}};
    gltf["buffers"][0]["byteLength"] = bytes.size();
    write(gltf.dump(), bytes);
  }
  ~GridFile() {
    std::error_code ignored;
    fs::remove(path_, ignored);
  }
  GridFile(const GridFile&) = delete;
  GridFile& operator=(const GridFile&) = delete;

 private:
  void write(std::string json, const std::string& bytes) const {
    json.resize((json.size() + 3) / 4 * 4, ' ');
    const auto words = [](std::initializer_list<std::uint32_t> values) {
      std::string out(values.size() * 4, '\0');
      std::memcpy(out.data(), values.begin(), out.size());
      return out;
    };
    const auto length = static_cast<std::uint32_t>(28 + json.size() + bytes.size());
    std::ofstream file(path_, std::ios::binary);
    file << words({0x46546c67, 2, length, static_cast<std::uint32_t>(json.size()), 0x4e4f534a}) << json
         << words({static_cast<std::uint32_t>(bytes.size()), 0x004e4942}) << bytes;
    if (!file) throw std::runtime_error(path_.string() + " cannot be written");
  }

  fs::path path_;
};

template <class Work>
double seconds(Work work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Sets the peak that the system remembers back to what is in use now.
void forget_peak() { std::ofstream("/proc/self/clear_refs") << "5"; }

void read_whole(const fs::path& path) {
  std::vector<char> bytes(fs::file_size(path));
  std::ifstream(path, std::ios::binary).read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

void measure(const fs::path& path) {
  const double read = seconds([&] { read_whole(path); });
  forget_peak();
  LoadedScene loaded;
  const double load = seconds([&] { loaded = load_gltf(path); });
  const double valid = seconds([&] { validate(loaded.scene); });
  const std::uint64_t open_peak = peak_memory_bytes();
  std::vector<Mesh> meshes;
  const double copy = seconds([&] { meshes = loaded.scene.meshes; });
  meshes = {};
  forget_peak();
  const double bvh = seconds([&] {
    const SceneArrays arrays(loaded.scene);
    const RayTracer tracer(arrays.view());
  });
  fmt::print("| {} | {} | {:.1f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.0f} | {:.0f} |\n",
             path.filename().string(), drawn_triangle_count(loaded.scene),
             static_cast<double>(fs::file_size(path)) / 1e6, read, load - read, copy, valid, bvh,
             static_cast<double>(open_peak) / 1048576, static_cast<double>(peak_memory_bytes()) / 1048576);
}

}  // namespace
}  // namespace lightcuts

int main(int argc, char** argv) {
  std::vector<std::string> files;
  std::uint64_t triangles = 10'000'000;
  CLI::App app("Where the time of opening a glTF scene goes, and how much memory it takes");
  app.add_option("files", files, "scene files");
  app.add_option("--triangles", triangles, "of a grid made for this; 0: none")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  fmt::print(
      "| file | triangles | MB | read s | decode s | (one copy s) | validate s | BVH s | peak MiB, open | with the BVH "
      "|\n"
      "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n");
  try {
    if (triangles > 0) {
      const std::filesystem::path path = std::filesystem::temp_directory_path() / "lightcuts-grid.glb";
      const lightcuts::GridFile grid(path, triangles);
      lightcuts::measure(path);
    }
    for (const std::string& file : files) lightcuts::measure(file);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
