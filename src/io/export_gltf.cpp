#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "io/atomic_file.h"
#include "io/export_formats.h"
#include "lightcuts/error.h"
#include "lightcuts/io.h"
#include "math/frame.h"

namespace lightcuts {
namespace {

using Json = nlohmann::ordered_json;

enum Target { array_buffer = 34962, element_array_buffer = 34963 };
enum ComponentType { unsigned_byte = 5121, unsigned_int = 5125, floating = 5126 };

Json vector_json(Vec3 v) { return {v.x, v.y, v.z}; }

/// Column by column, as glTF has it.
Json matrix_json(const Affine& m) {
  return {m.x.x, m.x.y, m.x.z, 0, m.y.x,      m.y.y,      m.y.z,      0,
          m.z.x, m.z.y, m.z.z, 0, m.origin.x, m.origin.y, m.origin.z, 1};
}

bool is_identity(const Affine& m) {
  const Affine one;
  return m.x == one.x && m.y == one.y && m.z == one.z && m.origin == one.origin;
}

/// One space whose -z axis is `direction`.
Affine looking_along(Vec3 direction, Vec3 origin) {
  const Frame frame = make_frame(-direction);
  return {frame.x, frame.y, frame.z, origin};
}

/// Builds the JSON and the one buffer behind it.
class GltfWriter {
 public:
  explicit GltfWriter(const Scene& scene) : scene_(scene) {
    root_ = {{"asset", {{"version", "2.0"}, {"generator", "lightcuts"}}}, {"scene", 0}};
    root_["scenes"] = Json::array({Json{{"nodes", Json::array()}}});
    for (const TextureImage& image : scene.images) add_image(image);
    for (const Material& material : scene.materials) add("materials", material_json(material));
    for (const Mesh& mesh : scene.meshes) add("meshes", mesh_json(mesh));
    for (const Instance& instance : scene.instances) add_instance(instance);
    for (const PointLight& light : scene.point_lights) add_point(light);
    for (const DirectionalLight& light : scene.directional_lights) {
      add_light({{"type", "directional"}}, light.irradiance, looking_along(light.direction, {}));
    }
    for (const Camera& camera : exported_cameras(scene)) add_camera(camera);
    if (scene.environment)
      warnings_.add("glTF has no light from outside; it was left out. Give it with --environment.");
    if (!extensions_.empty()) root_["extensionsUsed"] = extensions_;
  }

  [[nodiscard]] Json finish(const std::string& buffer_uri) {
    if (!buffer_.empty()) {
      Json buffer{{"byteLength", buffer_.size()}};
      if (!buffer_uri.empty()) buffer["uri"] = buffer_uri;
      root_["buffers"].push_back(buffer);
    }
    return root_;
  }
  [[nodiscard]] const std::vector<std::byte>& buffer() const { return buffer_; }
  std::vector<std::string> warnings() { return warnings_.take(); }

 private:
  /// Appends to one of the document's arrays; returns the index. Making `value` may add to the document, so a reference into
  /// that must not be held meanwhile.
  std::size_t add(const char* array, Json value) {
    Json& list = root_[array];
    list.push_back(std::move(value));
    return list.size() - 1;
  }

  void use(const char* extension) {
    if (std::find(extensions_.begin(), extensions_.end(), extension) == extensions_.end()) {
      extensions_.push_back(extension);
    }
  }

  std::size_t add_view(const void* data, std::size_t bytes, int target) {
    Json view{{"buffer", 0}, {"byteOffset", buffer_.size()}, {"byteLength", bytes}};
    if (target != 0) view["target"] = target;
    const std::size_t start = buffer_.size();
    buffer_.resize(start + (bytes + 3) / 4 * 4);
    std::memcpy(buffer_.data() + start, data, bytes);
    return add("bufferViews", std::move(view));
  }

  template <class T>
  std::size_t add_accessor(const std::vector<T>& values, ComponentType component, const char* type, std::size_t count,
                           Target target) {
    Json accessor{{"bufferView", add_view(values.data(), values.size() * sizeof(T), target)},
                  {"componentType", component},
                  {"count", count},
                  {"type", type}};
    if (component == unsigned_byte) accessor["normalized"] = true;
    return add("accessors", std::move(accessor));
  }

  void add_image(const TextureImage& image) {
    const std::vector<std::byte> png = encode_texture_png(image);
    const std::size_t view = add_view(png.data(), png.size(), 0);
    add("images", {{"name", image.name}, {"mimeType", "image/png"}, {"bufferView", view}});
  }

  static int wrap_code(Wrap wrap) {
    return wrap == Wrap::repeat ? 10497 : wrap == Wrap::mirrored_repeat ? 33648 : 33071;
  }

  /// Scale, rotation and offset of KHR_texture_transform; a shear is more than it can say.
  Json transform_json(const TextureRef& texture) {
    const std::array<float, 6>& m = texture.uv_transform;
    const float sx = std::hypot(m[0], m[3]);
    const float angle = std::atan2(-m[3], m[0]), c = std::cos(angle), s = std::sin(angle);
    const float sy = m[1] * s + m[4] * c;
    const float shear = m[1] * c - m[4] * s;
    if (std::abs(shear) > 1e-5f * (std::abs(sy) + std::abs(sx))) {
      warnings_.add("glTF has no shear of texture coordinates; it was left out.");
    }
    return {{"offset", {m[2], m[5]}}, {"rotation", angle}, {"scale", {sx, sy}}};
  }

  Json texture_json(const TextureRef& texture) {
    const std::size_t sampler = add("samplers", {{"magFilter", texture.nearest ? 9728 : 9729},
                                                 {"minFilter", texture.nearest ? 9728 : 9987},
                                                 {"wrapS", wrap_code(texture.wrap_u)},
                                                 {"wrapT", wrap_code(texture.wrap_v)}});
    const std::size_t number = add("textures", {{"sampler", sampler}, {"source", texture.image}});
    Json info{{"index", number}, {"texCoord", texture.texcoord}};
    if (texture.uv_transform != TextureRef{}.uv_transform) {
      use("KHR_texture_transform");
      info["extensions"] = {{"KHR_texture_transform", transform_json(texture)}};
    }
    return info;
  }

  Json material_json(const Material& m) {
    Json surface{{"baseColorFactor", {m.base_color.x, m.base_color.y, m.base_color.z, m.alpha}},
                 {"metallicFactor", 0},
                 {"roughnessFactor", 1}};
    if (m.base_color_texture.present()) surface["baseColorTexture"] = texture_json(m.base_color_texture);
    Json out{{"name", m.name}, {"pbrMetallicRoughness", surface}};
    const float strength = max_component(m.emission);
    if (strength > 0) {
      // A power of two divides without rounding.
      const float unit = strength > 1 ? std::exp2(std::ceil(std::log2(strength))) : 1;
      out["emissiveFactor"] = vector_json(m.emission / unit);
      if (unit != 1) {
        use("KHR_materials_emissive_strength");
        out["extensions"] = {{"KHR_materials_emissive_strength", {{"emissiveStrength", unit}}}};
      }
      if (m.emission_texture.present()) out["emissiveTexture"] = texture_json(m.emission_texture);
    }
    if (m.alpha_mode == AlphaMode::mask) {
      out["alphaMode"] = "MASK";
      out["alphaCutoff"] = m.alpha_cutoff;
    }
    if (m.double_sided) out["doubleSided"] = true;
    return out;
  }

  Json mesh_json(const Mesh& mesh) {
    const std::size_t count = mesh.positions.size();
    Box box;
    for (const Vec3& p : mesh.positions) box = extend(box, p);
    Json attributes{{"POSITION", add_accessor(mesh.positions, floating, "VEC3", count, array_buffer)}};
    root_["accessors"].back()["min"] = vector_json(box.lo);
    root_["accessors"].back()["max"] = vector_json(box.hi);
    if (!mesh.normals.empty()) {
      attributes["NORMAL"] = add_accessor(mesh.normals, floating, "VEC3", count, array_buffer);
    }
    for (std::size_t set = 0; set < mesh.texcoords.size(); ++set) {
      if (mesh.texcoords[set].empty()) continue;
      attributes[fmt::format("TEXCOORD_{}", set)] =
          add_accessor(mesh.texcoords[set], floating, "VEC2", count, array_buffer);
    }
    if (!mesh.colors.empty()) {
      attributes["COLOR_0"] = add_accessor(mesh.colors, unsigned_byte, "VEC4", count, array_buffer);
    }
    const std::size_t indices =
        add_accessor(mesh.triangles, unsigned_int, "SCALAR", 3 * mesh.triangles.size(), element_array_buffer);
    const Json primitive{{"attributes", attributes}, {"indices", indices}, {"material", mesh.material}, {"mode", 4}};
    return {{"name", mesh.name}, {"primitives", Json::array({primitive})}};
  }

  void add_node(Json node, const Affine& world_from_node) {
    if (!is_identity(world_from_node)) node["matrix"] = matrix_json(world_from_node);
    const std::size_t number = add("nodes", std::move(node));
    root_["scenes"][0]["nodes"].push_back(number);
  }

  void add_instance(const Instance& instance) {
    add_node({{"name", instance.name}, {"mesh", instance.mesh}}, instance.world_from_object);
  }

  void add_light(Json light, Vec3 intensity, const Affine& world_from_light) {
    use("KHR_lights_punctual");
    const float unit = std::max(1.0f, std::exp2(std::ceil(std::log2(std::max(max_component(intensity), 1.0f)))));
    light["color"] = vector_json(intensity / unit);
    light["intensity"] = unit;
    Json& lights = root_["extensions"]["KHR_lights_punctual"]["lights"];
    lights.push_back(std::move(light));
    const std::size_t number = lights.size() - 1;
    add_node({{"extensions", {{"KHR_lights_punctual", {{"light", number}}}}}}, world_from_light);
  }

  void add_point(const PointLight& light) {
    if (light.cos_outer < -1) {
      add_light({{"type", "point"}}, light.intensity, looking_along(light.axis, light.position));
      return;
    }
    const Json spot{{"innerConeAngle", std::acos(std::clamp(light.cos_inner, -1.0f, 1.0f))},
                    {"outerConeAngle", std::acos(std::clamp(light.cos_outer, -1.0f, 1.0f))}};
    add_light({{"type", "spot"}, {"spot", spot}}, light.intensity, looking_along(light.axis, light.position));
  }

  void add_camera(const Camera& camera) {
    Json lens{{"name", camera.name}};
    const float aspect = camera.aspect > 0 ? camera.aspect : 1;
    if (camera.orthographic_height > 0) {
      const float half = camera.orthographic_height / 2;
      lens["type"] = "orthographic";
      lens["orthographic"] = {{"xmag", half * aspect}, {"ymag", half}, {"znear", 0.001}, {"zfar", 1e6}};
    } else {
      lens["type"] = "perspective";
      lens["perspective"] = {{"yfov", camera.vertical_fov_rad}, {"znear", 0.001}};
      if (camera.aspect > 0) lens["perspective"]["aspectRatio"] = camera.aspect;
    }
    add_node({{"name", camera.name}, {"camera", add("cameras", std::move(lens))}}, camera.world_from_camera);
  }

  const Scene& scene_;
  Json root_;
  std::vector<std::byte> buffer_;
  std::vector<std::string> extensions_;
  ExportWarnings warnings_;
};

/// A file name as a URI.
std::string encoded(const std::string& name) {
  std::string out;
  for (const char c : name) {
    const bool plain =
        (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '.' || c == '-' || c == '_';
    out += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return out;
}

std::string dump(const Json& root, int indent) { return root.dump(indent, ' ', false, Json::error_handler_t::replace); }

void append_u32(std::vector<std::byte>& out, std::size_t value) {
  if (value > 0xffffffffu) throw Error(Code::invalid_argument, "a .glb file holds at most 4 GiB; write .gltf instead");
  for (int shift = 0; shift < 32; shift += 8) out.push_back(static_cast<std::byte>(value >> shift & 0xffu));
}

void append_chunk(std::vector<std::byte>& out, const char* type, std::span<const std::byte> data, char fill) {
  const std::size_t padded = (data.size() + 3) / 4 * 4;
  append_u32(out, padded);
  for (int i = 0; i < 4; ++i) out.push_back(static_cast<std::byte>(type[i]));
  out.insert(out.end(), data.begin(), data.end());
  out.resize(out.size() + padded - data.size(), static_cast<std::byte>(fill));
}

std::vector<std::byte> binary_file(const std::string& text, const std::vector<std::byte>& buffer) {
  std::vector<std::byte> chunks, file;
  append_chunk(chunks, "JSON", std::as_bytes(std::span(text)), ' ');
  if (!buffer.empty()) append_chunk(chunks, "BIN\0", buffer, '\0');
  for (const char c : {'g', 'l', 'T', 'F'}) file.push_back(static_cast<std::byte>(c));
  append_u32(file, 2);
  append_u32(file, 12 + chunks.size());
  file.insert(file.end(), chunks.begin(), chunks.end());
  return file;
}

}  // namespace

std::vector<std::string> export_gltf(const std::filesystem::path& path, const Scene& scene) {
  GltfWriter writer(scene);
  if (path.extension() == ".glb") {
    write_file(path, binary_file(dump(writer.finish(""), -1), writer.buffer()));
    return writer.warnings();
  }
  std::filesystem::path bin = path;
  bin.replace_extension(".bin");
  const std::string text = dump(writer.finish(encoded(bin.filename().string())), 1) + "\n";
  if (!writer.buffer().empty()) write_file(bin, writer.buffer());
  write_file(path, std::as_bytes(std::span(text)));
  return writer.warnings();
}

}  // namespace lightcuts
