#pragma once

#include <array>
#include <cstdint>

#include "backend/light_tree.h"
#include "cuda/device.h"
#include "cuda/vpl_kernels.h"

namespace lightcuts::cuda {

/// Kinds of light, in the order of LightTrees.
enum Kind : int { vpl_kind = 0, point_kind = 1, directional_kind = 2 };
inline constexpr int kKinds = 3;

/// A light as the inner loops of cuts read it: 48 bytes in three loads, the intensity being a cluster's.
struct alignas(16) StagedLight {
  Vec3 position;  ///< of a directional light: unused
  float red;
  Vec3 axis;  ///< of a directional light: the way it travels
  float green;
  float blue;
  float cos_outer, inverse_range;  ///< of points and spots
  std::uint32_t light;             ///< index among the lights of its kind
};
static_assert(sizeof(StagedLight) == 48);

/// Most nodes of a tree's upper level, from which a pixel's total is guessed.
inline constexpr std::uint32_t kFrontierSize = 64;

/// Most subtrees that a tree is taken apart into, from which blocks begin.
inline constexpr std::uint32_t kTreeParts = 512;

/// One tree, as kernels see it.
struct TreeView {
  const LightNode* nodes = nullptr;
  std::uint32_t leaf_count = 0;
  const StagedLight* frontier = nullptr;  ///< nodes that together hold every light, the brightest ones split first
  std::uint32_t frontier_count = 0;
  const std::uint32_t* parts =
      nullptr;  ///< kTreeParts nodes that together hold every light, of about as many each; or kNone
};
struct TreeViews {
  TreeView kind[kKinds];
};

/// A light tree in a device's memory.
struct DeviceTree {
  DeviceBuffer<LightNode> storage;  ///< node 0 stands one place in: siblings share two aligned cache lines
  DeviceBuffer<StagedLight> frontier;
  DeviceBuffer<std::uint32_t> parts;
  std::uint32_t leaf_count = 0, depth = 0;

  [[nodiscard]] std::uint32_t node_count() const { return leaf_count == 0 ? 0 : 2 * leaf_count - 1; }
  [[nodiscard]] TreeView view() const;
};
struct DeviceTrees {
  std::array<DeviceTree, kKinds> kind;
  [[nodiscard]] TreeViews view() const { return {{kind[0].view(), kind[1].view(), kind[2].view()}}; }
};

/// Builds one tree a kind of light on the device by locally ordered clustering, whatever options.builder says.
///
/// @param scene_diagonal  of the scene's box [m], > 0
/// Bit-identical from run to run. Throws Error{out_of_memory, invalid_argument}.
DeviceTrees build_light_trees(Device& device, const DeviceLights& lights, float scene_diagonal,
                              const TreeOptions& options);

/// Takes trees that were made elsewhere. Throws Error{invalid_argument} where they are not trees over these lights.
DeviceTrees upload_light_trees(Device& device, const LightTrees& trees, const DeviceLights& lights);

LightTrees download_light_trees(const DeviceTrees& trees);

}  // namespace lightcuts::cuda
