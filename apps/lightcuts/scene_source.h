#pragma once

#include <optional>
#include <string>

#include "lightcuts/io.h"
#include "lightcuts/scene.h"

namespace lightcuts::app {

inline constexpr const char* kSceneHelp =
    "a scene file (.gltf, .glb, .obj), or builtin:NAME[?key=value&...];\n'lightcuts scenes' lists the built-in ones";

/// Opens a scene as SCENE on the command line names it. Throws Error as load_scene and make_builtin_scene do.
LoadedScene open_scene(const std::string& spec);

/// Name for the files that are made from a scene: the file's without its ending, or the built-in scene's.
std::string base_name(const std::string& spec);

/// Lights a scene from outside as --environment says: a colour, or else a file. Adds to the scene's warnings.
/// Throws Error as parse_colour and load_image do.
void set_environment(LoadedScene& loaded, const std::string& colour_or_file);

/// A view as the command line asks for it.
struct CameraRequest {
  std::string which;                ///< name or number; empty: the first
  std::optional<Vec3> eye, target;  ///< both or neither
  std::optional<float> fov_deg;     ///< vertical
};

/// Throws Error{invalid_argument} if the scene has no such camera or the view is degenerate.
Camera choose_camera(const Scene& scene, const CameraRequest& request);

}  // namespace lightcuts::app
