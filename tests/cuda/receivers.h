#pragma once

#include <algorithm>
#include <vector>

#include "cuda/packet_cut.h"
#include "cut/cut_scene.h"

namespace lightcuts::cuda {

/// Random receivers in tiles of a warp, some alike as neighbours on a surface are, some scattered, some empty.
struct Receivers {
  std::vector<Vec3> position, ns, ng, albedo;

  explicit Receivers(unsigned seed, std::uint32_t tiles) {
    Dice dice(seed);
    for (std::uint32_t tile = 0; tile < tiles; ++tile) {
      const Vec3 corner = dice.in_box(1.5f), normal = dice.direction();
      const Vec3 side = normalize(cross(normal, Vec3{0.3f, 0.5f, 0.81f}));
      const bool scattered = tile % 3 == 2;
      for (std::uint32_t i = 0; i < kTilePixels; ++i) {
        const bool empty = tile % 4 == 1 && i % 5 == 0;
        const Vec3 n = scattered ? dice.direction() : normalize(normal + dice.in_box(tile % 2 == 0 ? 0.0f : 0.1f));
        position.push_back(scattered ? dice.in_box(1.5f) : corner + side * (0.002f * static_cast<float>(i)));
        ns.push_back(empty ? Vec3{} : n);
        ng.push_back(empty ? Vec3{} : n);
        albedo.push_back(tile % 7 == 3 ? Vec3{} : dice.color());
      }
    }
  }
  [[nodiscard]] std::uint32_t tiles() const { return static_cast<std::uint32_t>(position.size()) / kTilePixels; }
};

template <class T>
DeviceBuffer<T> send(Device& device, const std::vector<T>& values) {
  DeviceBuffer<T> buffer(device, values.size());
  buffer.upload(values.data(), values.size());
  device.synchronize();
  return buffer;
}
template <class T>
std::vector<T> fetch(const DeviceBuffer<T>& buffer) {
  std::vector<T> values(buffer.size());
  buffer.download(values.data(), values.size());
  return values;
}
template <class T>
DeviceBuffer<T> cleared(Device& device, std::size_t size) {
  DeviceBuffer<T> buffer(device, size);
  buffer.fill_bytes(0);
  return buffer;
}

/// The nodes of each pixel's last walk, by kind of light.
inline std::vector<test::CutNodes> last_walks(const std::vector<ListedNode>& nodes, std::size_t pixels) {
  std::vector<test::CutNodes> cuts(pixels);
  std::vector<std::uint32_t> last(pixels, 0);
  const auto each = [&](const ListedNode& node, auto body) {
    for (std::uint32_t lane = 0; lane < kTilePixels; ++lane) {
      if ((node.lanes >> lane & 1u) != 0) body(node.tile * kTilePixels + lane);
    }
  };
  for (const ListedNode& node : nodes)
    each(node, [&](std::uint32_t pixel) { last[pixel] = std::max(last[pixel], node.walk); });
  for (const ListedNode& node : nodes) {
    each(node, [&](std::uint32_t pixel) {
      if (node.walk == last[pixel]) cuts[pixel][node.kind].push_back(node.node);
    });
  }
  return cuts;
}

}  // namespace lightcuts::cuda
