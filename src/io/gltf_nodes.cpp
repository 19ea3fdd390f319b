#include "io/gltf_nodes.h"

#include <fmt/format.h>

#include <array>
#include <vector>

#include "io/gltf_lights.h"
#include "io/gltf_transform.h"

namespace lightcuts::gltf {
namespace {

/// For each node its parent, kNone for roots. Refuses nodes with two parents and cycles, wherever they are.
std::vector<std::uint32_t> find_parents(const JsonValue& nodes) {
  const auto count = static_cast<std::uint32_t>(nodes.size());
  std::vector<std::uint32_t> parents(count, kNone);
  for (std::uint32_t i = 0; i < count; ++i) {
    const JsonValue children = nodes[i].find("children");
    for (std::size_t c = 0; c < children.size(); ++c) {
      std::uint32_t& parent = parents[children[c].index_in(nodes, "a node")];
      if (parent != kNone) {
        children[c].fail(
            fmt::format("node {} is already a child of node {}; every node has one parent. Export the scene again.",
                        children[c].count(), parent));
      }
      parent = i;
    }
  }
  return parents;
}

/// With one parent at most for each node, a walk upwards that meets its own trace is in a cycle.
void refuse_cycles(const JsonValue& nodes, const std::vector<std::uint32_t>& parents) {
  std::vector<std::uint32_t> trace(parents.size(), kNone);
  for (std::uint32_t start = 0; start < parents.size(); ++start) {
    std::uint32_t node = start;
    while (node != kNone && trace[node] == kNone) {
      trace[node] = start;
      node = parents[node];
    }
    if (node != kNone && trace[node] == start) {
      nodes[node].fail("the node is its own ancestor. Export the scene again.");
    }
  }
}

/// Reads EXT_mesh_gpu_instancing: a transform for each copy of the node's mesh.
class InstanceTransforms {
 public:
  InstanceTransforms(const JsonValue& extension, Context& context, Buffers& buffers)
      : context_(context), buffers_(buffers) {
    const JsonValue attributes = extension.require("attributes");
    read(attributes.find("TRANSLATION"), 3, translations_);
    read(attributes.find("ROTATION"), 4, rotations_);
    read(attributes.find("SCALE"), 3, scales_);
    if (count_ == kUnknown) extension.fail("expected TRANSLATION, ROTATION or SCALE. Export the scene again.");
  }

  [[nodiscard]] std::size_t size() const { return count_; }

  [[nodiscard]] Transform operator[](std::size_t i) const {
    constexpr std::array<float, 3> kNoTranslation{0, 0, 0}, kNoScale{1, 1, 1};
    constexpr std::array<float, 4> kNoRotation{0, 0, 0, 1};
    return make_transform(translations_.empty() ? kNoTranslation.data() : &translations_[3 * i],
                          rotations_.empty() ? kNoRotation.data() : &rotations_[4 * i],
                          scales_.empty() ? kNoScale.data() : &scales_[3 * i]);
  }

 private:
  static constexpr std::size_t kUnknown = static_cast<std::size_t>(-1);

  void read(const JsonValue& reference, std::size_t width, std::vector<float>& out) {
    if (!reference) return;
    const Accessor accessor = open_accessor(reference, context_, buffers_);
    if (accessor.type.width != width)
      accessor.where.fail(fmt::format("expected elements of {} components here.", width));
    if (count_ != kUnknown && count_ != accessor.count) {
      accessor.where.fail(
          fmt::format("{} elements, but another attribute of the instances has {}.", accessor.count, count_));
    }
    count_ = accessor.count;
    context_.budget.charge(accessor.count * width * sizeof(float), accessor.where);
    out.resize(accessor.count * width);
    read_floats(accessor, {}, out.data());
  }

  Context& context_;
  Buffers& buffers_;
  std::size_t count_ = kUnknown;
  std::vector<float> translations_, rotations_, scales_;
};

/// Walks the node tree and collects what its nodes carry.
class NodeWalk {
 public:
  NodeWalk(Context& context, Buffers& buffers, Meshes& meshes, Scene& scene)
      : context_(context), buffers_(buffers), meshes_(meshes), scene_(scene), nodes_(context.array("nodes")) {}

  void run();

 private:
  struct Visit {
    std::uint32_t node;
    Transform world_from_parent;
  };
  std::vector<std::uint32_t> roots(const std::vector<std::uint32_t>& parents);
  void walk(std::uint32_t root, std::vector<bool>& seen);
  void visit(const JsonValue& node, const Transform& world_from_node);
  void place_mesh(const JsonValue& node, const JsonValue& mesh, const Transform& world_from_node,
                  const std::string& name);
  void warn_rest_pose(const JsonValue& node);

  Context& context_;
  Buffers& buffers_;
  Meshes& meshes_;
  Scene& scene_;
  JsonValue nodes_;
};

std::vector<std::uint32_t> NodeWalk::roots(const std::vector<std::uint32_t>& parents) {
  std::vector<std::uint32_t> roots;
  const JsonValue scenes = context_.array("scenes");
  const JsonValue chosen = context_.document.root().find("scene");
  if (scenes.size() == 0 && !chosen) {
    for (std::uint32_t i = 0; i < parents.size(); ++i) {
      if (parents[i] == kNone) roots.push_back(i);
    }
    return roots;
  }
  const JsonValue scene = chosen ? chosen.follow(scenes, "a scene") : scenes[0];
  scene_.name = scene.name();
  if (scenes.size() > 1) {
    context_.warnings.add(
        fmt::format("{}: only the default one of {} scenes was read.", context_.document.file(), scenes.size()));
  }
  const JsonValue list = scene.find("nodes");
  for (std::size_t i = 0; i < list.size(); ++i) {
    roots.push_back(list[i].index_in(nodes_, "a node"));
    if (parents[roots.back()] != kNone) {
      context_.warnings.add_at(
          list[i], "root", "this node has a parent and is no root of the scene; its parent's transform was ignored.");
    }
  }
  return roots;
}

void NodeWalk::run() {
  const std::vector<std::uint32_t> parents = find_parents(nodes_);
  refuse_cycles(nodes_, parents);
  std::vector<bool> seen(parents.size(), false);
  for (const std::uint32_t root : roots(parents)) walk(root, seen);
}

void NodeWalk::walk(std::uint32_t root, std::vector<bool>& seen) {
  std::vector<Visit> stack{{root, {}}};
  while (!stack.empty()) {
    const Visit next = stack.back();
    stack.pop_back();
    const JsonValue node = nodes_[next.node];
    if (seen[next.node]) {
      context_.warnings.add_at(node, "seen", "the scene names this node twice; it was drawn once.");
      continue;
    }
    seen[next.node] = true;
    if (!node.find("extensions").find("KHR_node_visibility").find("visible").boolean_or(true)) continue;
    const Transform world_from_node = next.world_from_parent * read_transform(node);
    visit(node, world_from_node);
    const JsonValue children = node.find("children");
    for (std::size_t c = children.size(); c-- > 0;) {
      stack.push_back({static_cast<std::uint32_t>(children[c].count()), world_from_node});
    }
  }
}

void NodeWalk::visit(const JsonValue& node, const Transform& world_from_node) {
  const std::string name = node.name();
  if (const JsonValue camera = node.find("camera")) {
    add_camera(camera, without_scale(world_from_node), name, context_, scene_);
  }
  if (const JsonValue light = node.find("extensions").find("KHR_lights_punctual")) {
    add_light(light.require("light"), without_scale(world_from_node), context_, scene_);
  }
  if (const JsonValue mesh = node.find("mesh")) {
    place_mesh(node, mesh, world_from_node, name);
    warn_rest_pose(node);
  }
}

void NodeWalk::place_mesh(const JsonValue& node, const JsonValue& mesh, const Transform& world_from_node,
                          const std::string& name) {
  const std::vector<std::uint32_t>& primitives = meshes_.use(mesh);
  const auto place = [&](const Transform& world_from_object) {
    context_.budget.charge(primitives.size() * (sizeof(Instance) + name.size()), node);
    for (const std::uint32_t primitive : primitives) {
      scene_.instances.push_back({name, primitive, to_affine(world_from_object)});
    }
  };
  const JsonValue instancing = node.find("extensions").find("EXT_mesh_gpu_instancing");
  if (!instancing) return place(world_from_node);
  const InstanceTransforms copies(instancing, context_, buffers_);
  for (std::size_t i = 0; i < copies.size(); ++i) place(world_from_node * copies[i]);
}

void NodeWalk::warn_rest_pose(const JsonValue& node) {
  if (node.find("skin")) {
    context_.warnings.add_at(node, "skin", "skins are not applied: the mesh is drawn as it was modelled.");
  }
  if (node.find("weights").size() > 0) {
    context_.warnings.add_at(node, "weights", "morph weights of nodes are ignored; those of the mesh are applied.");
  }
}

}  // namespace

void read_nodes(Context& context, Buffers& buffers, Meshes& meshes, Scene& scene) {
  NodeWalk(context, buffers, meshes, scene).run();
}

}  // namespace lightcuts::gltf
