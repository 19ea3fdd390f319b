#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "lightcuts/error.h"
#include "lightcuts/scene.h"
#include "scene/limits.h"

namespace lightcuts {

std::string label(const char* kind, std::size_t index, const std::string& name) {
  return name.empty() ? fmt::format("{} {}", kind, index) : fmt::format("{} {} \"{}\"", kind, index, name);
}

std::string counted(std::uint64_t count, const char* noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

namespace {

using Warnings = std::vector<std::string>;

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
  throw Error(Code::invalid_scene, where + " " + what);
}

// ---- numbers

/// Moves a number into [lo, hi]; NaN becomes lo. True if it was outside.
bool clamp_into(float& value, float lo, float hi) {
  if (value >= lo && value <= hi) return false;
  value = value > hi ? hi : lo;
  return true;
}

bool clamp_into(Vec3& value, float lo, float hi) {
  const bool x = clamp_into(value.x, lo, hi);
  const bool y = clamp_into(value.y, lo, hi);
  const bool z = clamp_into(value.z, lo, hi);
  return x || y || z;
}

bool is_dark(Vec3 v) { return v.x == 0 && v.y == 0 && v.z == 0; }

bool is_place(Vec3 p) {
  return is_finite(p) && std::max({std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)}) <= kLargestCoordinate;
}

/// Scales to unit length; false if there is no direction.
bool make_unit(Vec3& v) {
  const float size = length(v);
  if (!std::isnormal(size)) return false;
  if (std::fabs(size - 1.0f) > 1e-6f) v = v / size;
  return true;
}

void clamp_light(Vec3& value, const std::string& name, const char* what, Warnings& warnings) {
  if (clamp_into(value, 0, kLargestRadiance)) {
    warnings.push_back(fmt::format("{}: clamped {} to 0 ... {:g}.", name, what, kLargestRadiance));
  }
}

// ---- images and materials

void validate_image(const TextureImage& image, std::size_t index) {
  const std::string name = label("image", index, image.name);
  if (image.width < 1 || image.height < 1 || image.channels < 1 || image.channels > 4) {
    refuse(name, fmt::format("has {} x {} pixels of {} channels; expected at least one pixel and 1 to 4 channels.",
                             image.width, image.height, image.channels));
  }
  const auto expected = static_cast<std::uint64_t>(image.width) * static_cast<std::uint64_t>(image.height) *
                        static_cast<std::uint64_t>(image.channels);
  if (image.texels.size() != expected) {
    refuse(name, fmt::format("holds {} bytes, but {} x {} pixels of {} channels need {}.", image.texels.size(),
                             image.width, image.height, image.channels, expected));
  }
}

void validate_texture(TextureRef& texture, std::size_t image_count, const std::string& name, const char* role,
                      Warnings& warnings) {
  if (!texture.present()) return;
  if (texture.image >= image_count) {
    refuse(name, fmt::format("takes its {} from image {}, but there are {}.", role, texture.image, image_count));
  }
  if (texture.texcoord > 1) {
    refuse(name,
           fmt::format("reads its {} with texture coordinates {}; only sets 0 and 1 exist.", role, texture.texcoord));
  }
  const bool usable = std::all_of(texture.uv_transform.begin(), texture.uv_transform.end(),
                                  [](float m) { return std::fabs(m) <= kLargestTexcoord; });
  if (usable) return;
  texture.uv_transform = TextureRef{}.uv_transform;
  warnings.push_back(fmt::format("{}: ignored the transform of its {}, which is not finite.", name, role));
}

void validate_material(Material& material, std::size_t index, std::size_t image_count, Warnings& warnings) {
  const std::string name = label("material", index, material.name);
  validate_texture(material.base_color_texture, image_count, name, "base colour texture", warnings);
  validate_texture(material.emission_texture, image_count, name, "emission texture", warnings);
  validate_texture(material.metallic_roughness_texture, image_count, name, "metallic-roughness texture", warnings);

  const auto clamp_unit = [&](auto& value, const char* what) {
    if (clamp_into(value, 0.0f, 1.0f)) warnings.push_back(fmt::format("{}: clamped its {} to 0 ... 1.", name, what));
  };
  clamp_unit(material.base_color, "base colour");
  clamp_unit(material.alpha, "alpha");
  clamp_unit(material.metallic, "metalness");
  clamp_unit(material.roughness, "roughness");
  // A cutoff above one is allowed and means: nothing is there.
  if (clamp_into(material.alpha_cutoff, 0, 2)) warnings.push_back(fmt::format("{}: clamped its alpha cutoff.", name));
  clamp_light(material.emission, name, "its emission", warnings);
}

/// Gives meshes that name no material, in a scene that may have none, a white one.
void add_missing_material(Scene& scene, Warnings& warnings) {
  const bool none = scene.materials.empty();
  const auto lacks = [&](const Mesh& mesh) { return mesh.material == kNone || (none && mesh.material == 0); };
  const auto count = static_cast<std::uint64_t>(std::count_if(scene.meshes.begin(), scene.meshes.end(), lacks));
  if (count == 0) return;
  for (Mesh& mesh : scene.meshes) {
    if (lacks(mesh)) mesh.material = static_cast<std::uint32_t>(scene.materials.size());
  }
  Material white;
  white.name = "default";
  white.base_color = {0.8f, 0.8f, 0.8f};
  scene.materials.push_back(white);
  warnings.push_back(fmt::format("{} had no material and became light grey.",
                                 count == 1 ? "1 mesh" : fmt::format("{} meshes", count)));
}

// ---- instances

/// Scales within nine orders of magnitude and axes that span space: what float normals and inverses stand.
bool is_invertible(const Affine& m) {
  const float x = length(m.x), y = length(m.y), z = length(m.z);
  for (const float scale : {x, y, z}) {
    if (!(scale >= 1e-9f && scale <= 1e9f)) return false;
  }
  return std::fabs(determinant({m.x / x, m.y / y, m.z / z, {}})) > 1e-6f;
}

void validate_instances(Scene& scene, Warnings& warnings) {
  std::vector<Box> boxes;
  boxes.reserve(scene.meshes.size());
  for (const Mesh& mesh : scene.meshes) boxes.push_back(mesh_bounds(mesh, Affine{}));

  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    if (instance.mesh >= scene.meshes.size()) {
      refuse(label("instance", i, instance.name),
             fmt::format("draws mesh {}, but there are {}.", instance.mesh, scene.meshes.size()));
    }
  }

  // Remove what has no volume scale, then look how far the rest reaches.
  std::string first;
  const auto removed = std::erase_if(scene.instances, [&](const Instance& instance) {
    const bool usable = is_invertible(instance.world_from_object) && is_finite(instance.world_from_object.origin);
    if (!usable && first.empty()) {
      first = label("mesh", instance.mesh, instance.name.empty() ? scene.meshes[instance.mesh].name : instance.name);
    }
    return !usable;
  });
  if (removed > 0) {
    warnings.push_back(fmt::format("Removed {} whose transform is singular or not finite, the first of {}.",
                                   counted(removed, "instance"), first));
  }
  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    if (is_empty(boxes[instance.mesh])) continue;
    const Box box = transform_box(instance.world_from_object, boxes[instance.mesh]);
    if (is_place(box.lo) && is_place(box.hi)) continue;
    refuse(label("instance", i, instance.name),
           fmt::format("reaches beyond {:g} m, where squares of areas overflow; scale the scene down.",
                       kLargestCoordinate));
  }
}

// ---- lights

void validate_spot(PointLight& light, const std::string& name, Warnings& warnings) {
  if (!std::isfinite(light.cos_outer) || !std::isfinite(light.cos_inner)) {
    refuse(name, "has a cone whose cosines are not finite numbers.");
  }
  if (light.cos_outer <= -1) {
    light.cos_outer = -2;
    light.axis = {0, 0, -1};
    return;
  }
  if (!make_unit(light.axis)) refuse(name, "is a spot light whose axis has no direction.");
  if (light.cos_inner > light.cos_outer && light.cos_inner <= 1) return;
  light.cos_outer = std::min(light.cos_outer, 0.9999f);
  light.cos_inner = std::clamp(light.cos_inner, light.cos_outer + 1e-4f, 1.0f);
  warnings.push_back(fmt::format("{}: moved its inner cone inside its outer cone.", name));
}

void validate_point_lights(Scene& scene, Warnings& warnings) {
  for (std::size_t i = 0; i < scene.point_lights.size(); ++i) {
    PointLight& light = scene.point_lights[i];
    const bool usual = is_place(light.position) && light.cos_outer == -2.0f && light.intensity.x >= 0 &&
                       light.intensity.y >= 0 && light.intensity.z >= 0 && light.intensity.x <= kLargestRadiance &&
                       light.intensity.y <= kLargestRadiance && light.intensity.z <= kLargestRadiance;
    if (usual) continue;  // a million lamps do not need a million labels
    const std::string name = label("point light", i, "");
    if (!is_place(light.position)) refuse(name, "has no place: its position is not finite or too far away.");
    clamp_light(light.intensity, name, "its intensity", warnings);
    validate_spot(light, name, warnings);
  }
  const auto dark = std::erase_if(scene.point_lights, [](const PointLight& light) { return is_dark(light.intensity); });
  if (dark > 0) warnings.push_back(fmt::format("Removed {} without intensity.", counted(dark, "point light")));
}

void validate_directional_lights(Scene& scene, Warnings& warnings) {
  for (std::size_t i = 0; i < scene.directional_lights.size(); ++i) {
    DirectionalLight& light = scene.directional_lights[i];
    const std::string name = label("directional light", i, "");
    if (!make_unit(light.direction)) refuse(name, "has no direction.");
    clamp_light(light.irradiance, name, "its irradiance", warnings);
  }
  const auto dark =
      std::erase_if(scene.directional_lights, [](const DirectionalLight& light) { return is_dark(light.irradiance); });
  if (dark > 0) warnings.push_back(fmt::format("Removed {} without irradiance.", counted(dark, "directional light")));
}

/// Replaces pixels that are no radiance; the picture is copied only if there are any.
void validate_environment_image(Environment& environment, Warnings& warnings) {
  const Image& image = *environment.image;
  if (image.width < 1 || image.height < 1) refuse("The environment", "is a picture without pixels.");
  const auto is_bad = [](float v) { return !(v >= 0 && v <= kLargestRadiance); };
  std::uint64_t bad = 0;
  for (const char* plane : {"R", "G", "B"}) {
    const Channel* channel = find_channel(image, plane);
    if (channel == nullptr || channel->values.size() != image.pixel_count()) {
      refuse("The environment", fmt::format("has no whole plane {}; expected R, G and B.", plane));
    }
    bad += static_cast<std::uint64_t>(std::count_if(channel->values.begin(), channel->values.end(), is_bad));
  }
  if (bad == 0) return;
  auto repaired = std::make_shared<Image>(image);
  for (Channel& channel : repaired->channels) {
    for (float& value : channel.values) clamp_into(value, 0, kLargestRadiance);
  }
  environment.image = repaired;
  warnings.push_back(
      fmt::format("The environment: clamped {} to 0 ... {:g}.", counted(bad, "value"), kLargestRadiance));
}

void validate_environment(Scene& scene, Warnings& warnings) {
  if (!scene.environment) return;
  clamp_light(scene.environment->radiance, "The environment", "its radiance", warnings);
  if (scene.environment->image) validate_environment_image(*scene.environment, warnings);
  if (!is_dark(scene.environment->radiance)) return;
  scene.environment.reset();
  warnings.emplace_back("Removed an environment without radiance.");
}

// ---- cameras

/// Makes the axes orthonormal and right-handed, keeping the viewing direction; false if that is impossible.
bool repair_axes(Affine& m, bool& changed) {
  const Affine before = m;
  if (!make_unit(m.z) || !make_unit(m.y)) return false;
  m.x = cross(m.y, m.z);
  if (length(m.x) < 1e-4f || !make_unit(m.x)) return false;
  m.y = normalize(cross(m.z, m.x));
  const auto differ = [](Vec3 a, Vec3 b) { return !(length(a - b) < 1e-3f); };
  changed = differ(before.x, m.x) || differ(before.y, m.y) || differ(before.z, m.z);
  return true;
}

/// False if the camera sees nothing that can be repaired.
bool validate_camera(Camera& camera, const std::string& name, Warnings& warnings) {
  bool changed = false;
  if (!is_place(camera.world_from_camera.origin) || !repair_axes(camera.world_from_camera, changed)) {
    warnings.push_back(fmt::format("Removed {}: its place or its axes are not usable.", name));
    return false;
  }
  if (changed) warnings.push_back(fmt::format("{}: made its axes orthonormal.", name));
  if (!(camera.vertical_fov_rad > 0 && camera.vertical_fov_rad < kPi)) {
    camera.vertical_fov_rad = Camera{}.vertical_fov_rad;
    warnings.push_back(fmt::format("{}: replaced its angle of view, which was not between 0 and 180 degrees.", name));
  }
  if (!(camera.orthographic_height >= 0 && camera.orthographic_height <= kLargestCoordinate)) {
    camera.orthographic_height = 0;
    warnings.push_back(fmt::format("{}: ignored its orthographic height and made it a perspective one.", name));
  }
  if (!(camera.aspect >= 0 && camera.aspect <= 1e4f)) {
    camera.aspect = 0;
    warnings.push_back(fmt::format("{}: ignored its aspect ratio.", name));
  }
  return true;
}

void validate_cameras(Scene& scene, Warnings& warnings) {
  std::size_t index = 0;
  std::vector<Camera> kept;
  for (Camera& camera : scene.cameras) {
    if (validate_camera(camera, label("camera", index++, camera.name), warnings)) kept.push_back(camera);
  }
  scene.cameras = std::move(kept);
  if (scene.width >= 0 && scene.height >= 0 && scene.width <= 1 << 20 && scene.height <= 1 << 20) return;
  warnings.push_back(fmt::format("Ignored the picture size {} x {}.", scene.width, scene.height));
  scene.width = scene.height = 0;
}

}  // namespace

std::vector<std::string> validate(Scene& scene) {
  Warnings warnings;
  for (std::size_t i = 0; i < scene.images.size(); ++i) validate_image(scene.images[i], i);
  add_missing_material(scene, warnings);
  for (std::size_t i = 0; i < scene.materials.size(); ++i) {
    validate_material(scene.materials[i], i, scene.images.size(), warnings);
  }
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
    if (scene.meshes[i].material >= scene.materials.size()) {
      refuse(label("mesh", i, scene.meshes[i].name),
             fmt::format("uses material {}, but there are {}.", scene.meshes[i].material, scene.materials.size()));
    }
    validate_mesh(scene.meshes[i], i, warnings);
  }
  validate_instances(scene, warnings);
  validate_point_lights(scene, warnings);
  validate_directional_lights(scene, warnings);
  validate_environment(scene, warnings);
  validate_cameras(scene, warnings);
  return warnings;
}

}  // namespace lightcuts
