#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "lightcuts/scene.h"

namespace lightcuts {

// As export_scene, one format each.
std::vector<std::string> export_gltf(const std::filesystem::path& path, const Scene& scene);
std::vector<std::string> export_mitsuba(const std::filesystem::path& path, const Scene& scene);

/// A texture as a PNG file, with as many channels as it has.
std::vector<std::byte> encode_texture_png(const TextureImage& image);

/// The cameras to write: the scene's, or the one that would be looked through.
std::vector<Camera> exported_cameras(const Scene& scene);

/// Sentences that are each kept once.
class ExportWarnings {
 public:
  void add(const std::string& sentence);
  [[nodiscard]] std::vector<std::string> take() { return std::move(sentences_); }

 private:
  std::vector<std::string> sentences_;
};

}  // namespace lightcuts
