#pragma once

#include "io/gltf_context.h"
#include "lightcuts/scene.h"

namespace lightcuts::gltf {

/// Adds the light of KHR_lights_punctual whose index is `reference` to the scene.
///
/// Photometric values are used one to one: candela as W/sr, lux as W/m^2. Throws Error{malformed}.
void add_light(const JsonValue& reference, const Affine& world_from_light, Context& context, Scene& scene);

/// Adds the camera whose index is `reference` to the scene. Throws Error{malformed}.
void add_camera(const JsonValue& reference, const Affine& world_from_camera, const std::string& node_name,
                Context& context, Scene& scene);

}  // namespace lightcuts::gltf
