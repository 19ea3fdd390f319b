#include "io/export_formats.h"
#include "lightcuts/error.h"
#include "lightcuts/export.h"

namespace lightcuts {

std::vector<std::string> export_scene(const std::filesystem::path& path, const Scene& scene) {
  const std::string ending = path.extension().string();
  if (ending == ".gltf" || ending == ".glb") return export_gltf(path, scene);
  if (ending == ".xml") return export_mitsuba(path, scene);
  throw Error(Code::invalid_argument,
              "'" + path.string() + "' should end in .gltf, .glb (glTF 2.0) or .xml (Mitsuba 3)");
}

}  // namespace lightcuts
