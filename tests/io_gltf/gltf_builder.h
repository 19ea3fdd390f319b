#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "io/gltf.h"

namespace lightcuts::testing {

using nlohmann::json;

/// Writes a file of the running test and returns its path.
inline std::filesystem::path write_file(const std::string& name, const std::string& bytes) {
  const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
  const std::filesystem::path folder =
      std::filesystem::path(::testing::TempDir()) / "lightcuts_io_gltf" / test->test_suite_name() / test->name();
  std::filesystem::create_directories(folder);
  std::ofstream(folder / name, std::ios::binary) << bytes;
  return folder / name;
}

inline void append_u32(std::string& out, std::size_t value) {
  for (int i = 0; i < 4; ++i) out += static_cast<char>(value >> (8 * i) & 0xff);
}

/// A glTF file in the making: `root` is its JSON, `binary` its only buffer.
struct GltfBuilder {
  json root = json::parse(R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
                              "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {}}]}],
                              "bufferViews": [], "accessors": []})");
  std::string binary;

  json& primitive() { return root["meshes"][0]["primitives"][0]; }

  std::size_t add_view(const std::string& bytes, std::size_t stride = 0) {
    while (binary.size() % 4 != 0) binary += '\0';
    json view{{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes.size()}};
    if (stride > 0) view["byteStride"] = stride;
    binary += bytes;
    root["bufferViews"].push_back(view);
    return root["bufferViews"].size() - 1;
  }

  template <class T>
  std::size_t add_values(const std::vector<T>& values, std::size_t stride = 0) {
    std::string bytes(values.size() * sizeof(T), '\0');
    std::memcpy(bytes.data(), values.data(), bytes.size());
    return add_view(bytes, stride);
  }

  std::size_t add_accessor(std::size_t view, int component, const char* type, std::size_t count) {
    root["accessors"].push_back({{"bufferView", view}, {"componentType", component}, {"type", type}, {"count", count}});
    return root["accessors"].size() - 1;
  }

  /// A float attribute of the first primitive.
  std::size_t add_attribute(const char* name, const char* type, std::size_t width, const std::vector<float>& values) {
    const std::size_t accessor = add_accessor(add_values(values), 5126, type, values.size() / width);
    primitive()["attributes"][name] = accessor;
    return accessor;
  }

  void add_indices(const std::vector<std::uint16_t>& indices) {
    primitive()["indices"] = add_accessor(add_values(indices), 5123, "SCALAR", indices.size());
  }

  [[nodiscard]] std::string glb() const {
    json with_buffer = root;
    with_buffer["buffers"] = json::array({{{"byteLength", binary.size()}}});
    std::string text = with_buffer.dump();
    while (text.size() % 4 != 0) text += ' ';
    std::string data = binary;
    while (data.size() % 4 != 0) data += '\0';
    std::string out = "glTF";
    append_u32(out, 2);
    append_u32(out, 12 + 8 + text.size() + 8 + data.size());
    append_u32(out, text.size());
    out += "JSON" + text;
    append_u32(out, data.size());
    out += std::string("BIN\0", 4) + data;
    return out;
  }

  LoadedScene load() const { return load_gltf(write_file("scene.glb", glb())); }
};

/// A unit square in the xy-plane, two triangles.
inline GltfBuilder make_square() {
  GltfBuilder square;
  square.add_attribute("POSITION", "VEC3", 3, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
  square.add_attribute("TEXCOORD_0", "VEC2", 2, {0, 1, 1, 1, 1, 0, 0, 0});
  square.add_indices({0, 1, 2, 0, 2, 3});
  return square;
}

/// True if one of the warnings holds `part`.
inline bool warns(const LoadedScene& loaded, const std::string& part) {
  for (const std::string& warning : loaded.warnings) {
    if (warning.find(part) != std::string::npos) return true;
  }
  return false;
}

}  // namespace lightcuts::testing
