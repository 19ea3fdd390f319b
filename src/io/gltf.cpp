// glTF 2.0. The JSON is read here and not through tinygltf, because the one of Debian 12 refuses the fallback buffers of
// files compressed by meshopt, decodes images before anyone can look at their size, and gives no say in what a hostile
// file may make it allocate.

#include "io/gltf.h"

#include <fmt/format.h>

#include "io/gltf_extensions.h"
#include "io/gltf_glb.h"
#include "io/gltf_images.h"
#include "io/gltf_materials.h"
#include "io/gltf_meshes.h"
#include "io/gltf_nodes.h"

namespace lightcuts {
namespace {

using namespace gltf;

Container split(const Bytes& file, const std::string& name, bool binary, Warnings& warnings) {
  if (binary || is_glb(file)) return split_glb(file, name, warnings);
  return {{reinterpret_cast<const char*>(file.data()), file.size()}, std::nullopt};
}

Scene read_scene(Context& context, std::optional<std::span<const std::byte>> binary) {
  check_requirements(context);
  if (context.array("animations").size() > 0) {
    context.warnings.add(
        fmt::format("{}: animations are ignored; the scene is drawn at rest.", context.document.file()));
  }
  Scene scene;
  Buffers buffers(context, binary);
  Images images(context, buffers);
  Materials materials(context, images);
  Meshes meshes(context, buffers, materials);
  read_nodes(context, buffers, meshes, scene);
  scene.meshes = meshes.take();
  scene.materials = materials.take();
  scene.images = images.decode(scene.materials);
  materials.settle_blending(scene.materials, scene.images);
  return scene;
}

}  // namespace

LoadedScene load_gltf(const std::filesystem::path& path) {
  const std::string name = path.string();
  try {
    Bytes file = read_regular_file(path, name);
    Warnings warnings;
    const Container container = split(file, name, path.extension() == ".glb", warnings);
    const JsonDocument document(name, container.json);
    Context context{document, path.parent_path(), std::move(warnings)};
    context.budget.add_input(file.size());
    if (!container.binary) file = {};  // all of it is in the document
    LoadedScene loaded;
    loaded.scene = read_scene(context, container.binary);
    if (loaded.scene.name.empty()) loaded.scene.name = readable_name(path.stem().string());
    loaded.warnings = context.warnings.take();
    return loaded;
  } catch (const std::bad_alloc&) {
    throw Error(Code::out_of_memory, fmt::format("{}: there is not enough memory to read this scene.", name));
  }
}

}  // namespace lightcuts
