// How long ten million triangles take to open, and how much memory. By hand, as it takes seconds and a gigabyte:
//   build/bin/test_io_gltf --gtest_also_run_disabled_tests --gtest_filter='LargeFile.*'

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <iostream>
#include <string>

#include "gltf_builder.h"
#include "lightcuts/io.h"

namespace lightcuts {
namespace {

/// A wavy grid of `side` x `side` quads with normals and texture coordinates, written to a file.
std::filesystem::path write_grid(std::uint32_t side) {
  testing::GltfBuilder grid;
  const std::uint32_t row = side + 1;
  std::vector<float> positions, normals, texcoords;
  for (std::uint32_t i = 0; i < row * row; ++i) {
    const float u = static_cast<float>(i % row) / static_cast<float>(side);
    const float v = static_cast<float>(i / row) / static_cast<float>(side);
    positions.insert(positions.end(), {u * 100, std::sin(u * 60) * std::sin(v * 60), v * 100});
    normals.insert(normals.end(), {0, 1, 0});
    texcoords.insert(texcoords.end(), {u, v});
  }
  grid.add_attribute("POSITION", "VEC3", 3, positions);
  grid.add_attribute("NORMAL", "VEC3", 3, normals);
  grid.add_attribute("TEXCOORD_0", "VEC2", 2, texcoords);
  std::vector<std::uint32_t> indices;
  for (std::uint32_t q = 0; q < side * side; ++q) {
    const std::uint32_t a = q / side * row + q % side;
    indices.insert(indices.end(), {a, a + row, a + 1, a + 1, a + row, a + row + 1});
  }
  grid.primitive()["indices"] = grid.add_accessor(grid.add_values(indices), 5125, "SCALAR", indices.size());
  return testing::write_file("grid.glb", grid.glb());
}

/// Sets the peak that the system remembers back to what is in use now.
void forget_peak() { std::ofstream("/proc/self/clear_refs") << "5"; }

std::string peak_memory() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM")) return line;
  }
  return "unknown";
}

TEST(LargeFile, DISABLED_TenMillionTriangles) {
  const auto path = write_grid(2237);
  for (const bool validated : {false, true}) {
    forget_peak();
    const auto start = std::chrono::steady_clock::now();
    const LoadedScene loaded = validated ? load_scene(path) : load_gltf(path);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    EXPECT_EQ(drawn_triangle_count(loaded.scene), 2u * 2237u * 2237u);
    std::cout << (validated ? "with" : "without") << " validation: " << seconds.count() << " s, " << peak_memory()
              << ", " << std::filesystem::file_size(path) / 1000000 << " MB file\n";
  }
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace lightcuts
