#include "io/obj.h"

#include <new>

#include "io/obj_materials.h"
#include "io/obj_meshes.h"
#include "io/obj_parse.h"
#include "lightcuts/error.h"

namespace lightcuts {

LoadedScene load_obj(const std::filesystem::path& path) {
  try {
    obj::Notes notes(path.string());
    obj::Data data = obj::parse(path, notes);

    LoadedScene loaded;
    loaded.scene.name = path.stem().string();
    notes.append_to(loaded.warnings);
    obj::add_materials(data, path.parent_path(), loaded.scene, loaded.warnings);
    obj::add_meshes(data, loaded.scene);
    return loaded;
  } catch (const std::bad_alloc&) {
    throw Error(Code::out_of_memory, path.string() + ": there is not enough memory to read the scene.");
  }
}

}  // namespace lightcuts
