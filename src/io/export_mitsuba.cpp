#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "io/atomic_file.h"
#include "io/export_formats.h"
#include "lightcuts/error.h"
#include "lightcuts/io.h"

namespace lightcuts {
namespace {

/// Text as an attribute's value.
std::string quoted(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
    }
  }
  return '"' + out + '"';
}

std::string rgb_tag(const char* name, Vec3 v) {
  return fmt::format("<rgb name=\"{}\" value=\"{} {} {}\"/>", name, v.x, v.y, v.z);
}

std::string matrix_tag(Vec3 x, Vec3 y, Vec3 z, Vec3 o) {
  return fmt::format(
      "<transform name=\"to_world\"><matrix value=\"{} {} {} {} {} {} {} {} {} {} {} {} 0 0 0 1\"/></transform>", x.x,
      y.x, z.x, o.x, x.y, y.y, z.y, o.y, x.z, y.z, z.z, o.z);
}

float linear_from_srgb(float v) { return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f); }

/// A colour texture times a factor, linear.
Image scaled_texture(const TextureImage& texture, Vec3 factor) {
  Image image = make_rgb_image(texture.width, texture.height);
  const float factors[] = {factor.x, factor.y, factor.z};
  for (std::size_t i = 0; i < image.pixel_count(); ++i) {
    const std::uint8_t* texel = &texture.texels[i * static_cast<std::size_t>(texture.channels)];
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint8_t value = texel[texture.channels >= 3 ? c : 0];
      image.channels[c].values[i] = factors[c] * linear_from_srgb(static_cast<float>(value) / 255);
    }
  }
  return image;
}

/// One where a texel's alpha passes the cutoff, as a grey picture.
Image mask_texture(const TextureImage& texture, float alpha, float cutoff) {
  Image image = make_rgb_image(texture.width, texture.height);
  const auto channels = static_cast<std::size_t>(texture.channels);
  for (std::size_t i = 0; i < image.pixel_count(); ++i) {
    const bool varies = channels == 2 || channels == 4;
    const float value = varies ? static_cast<float>(texture.texels[i * channels + channels - 1]) / 255 : 1;
    for (Channel& channel : image.channels) channel.values[i] = value * alpha >= cutoff ? 1.0f : 0.0f;
  }
  return image;
}

/// A mesh in world space, as binary PLY. Mirrored instances are turned round, so that fronts stay fronts.
class PlyWriter {
 public:
  PlyWriter(const Mesh& mesh, const Affine& world_from_object, const TextureRef& texture)
      : mesh_(mesh), place_(world_from_object), texture_(texture) {
    const std::vector<Vec2>& coordinates = mesh.texcoords[texture.texcoord];
    const bool textured = !coordinates.empty();
    header_ = fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", mesh.positions.size());
    add_properties("x y z");
    if (!mesh.normals.empty()) add_properties("nx ny nz");
    if (textured) add_properties("u v");
    if (!mesh.colors.empty()) add_properties("r g b");
    header_ +=
        fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n", mesh.triangles.size());
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      put(transform_point(place_, mesh.positions[i]));
      if (!mesh.normals.empty()) put(normalize(transform_normal(place_, mesh.normals[i])));
      if (textured) put(coordinates[i]);
      if (!mesh.colors.empty()) {
        const auto& c = mesh.colors[i];
        put(Vec3{static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])} / 255.0f);
      }
    }
    const bool mirrored = determinant(place_) < 0;
    for (const auto& t : mesh.triangles) {
      body_.push_back(std::byte{3});
      for (const std::uint32_t corner : {t[0], t[mirrored ? 2 : 1], t[mirrored ? 1 : 2]})
        append(&corner, sizeof corner);
    }
  }

  void write(const std::filesystem::path& path) const {
    AtomicFile file(path);
    file.write(std::as_bytes(std::span(header_)));
    file.write(body_);
    file.commit();
  }

 private:
  void add_properties(const char* names) {
    for (std::string_view rest = names; !rest.empty();) {
      const std::size_t end = std::min(rest.find(' '), rest.size());
      header_ += fmt::format("property float {}\n", rest.substr(0, end));
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
  }
  void append(const void* data, std::size_t bytes) {
    const auto* from = static_cast<const std::byte*>(data);
    body_.insert(body_.end(), from, from + bytes);
  }
  void put(Vec3 v) {
    for (const float f : {v.x, v.y, v.z}) append(&f, sizeof f);
  }
  /// The texture's transform is done here once, for Mitsuba has one for each texture and ours differ by use.
  void put(Vec2 t) {
    const std::array<float, 6>& m = texture_.uv_transform;
    for (const float f : {m[0] * t.x + m[1] * t.y + m[2], m[3] * t.x + m[4] * t.y + m[5]}) append(&f, sizeof f);
  }

  const Mesh& mesh_;
  Affine place_;
  const TextureRef& texture_;
  std::string header_;
  std::vector<std::byte> body_;
};

/// Collects the text of the XML while it writes the files that this refers to.
class MitsubaWriter {
 public:
  MitsubaWriter(const std::filesystem::path& path, const Scene& scene) : scene_(scene), folder_(path) {
    folder_.replace_extension();
    std::error_code error;
    std::filesystem::create_directories(folder_, error);
    if (error)
      throw Error(Code::cannot_write, "the folder '" + folder_.string() + "' cannot be made: " + error.message());
    text_ = "<scene version=\"3.0.0\">\n";
    for (const auto& [name, value] : {std::pair{"samples", 64},
                                      {"width", scene.width > 0 ? scene.width : 512},
                                      {"height", scene.height > 0 ? scene.height : 512}}) {
      line(fmt::format("<default name=\"{}\" value=\"{}\"/>", name, value));
    }
    line("<integrator type=\"path\"><integer name=\"max_depth\" value=\"66\"/></integrator>");
    add_camera(exported_cameras(scene).front());
    if (exported_cameras(scene).size() > 1) warnings_.add("Only the first camera was written.");
    for (std::size_t i = 0; i < scene.materials.size(); ++i) add_material(i);
    for (std::size_t i = 0; i < scene.instances.size(); ++i) add_shape(i);
    for (const PointLight& light : scene.point_lights) add_point(light);
    for (const DirectionalLight& light : scene.directional_lights) {
      line(fmt::format(
          "<emitter type=\"directional\"><vector name=\"direction\" x=\"{}\" y=\"{}\" z=\"{}\"/>{}</emitter>",
          light.direction.x, light.direction.y, light.direction.z, rgb_tag("irradiance", light.irradiance)));
    }
    if (scene.environment) add_environment(*scene.environment);
    text_ += "</scene>\n";
  }

  [[nodiscard]] const std::string& text() const { return text_; }
  std::vector<std::string> warnings() { return warnings_.take(); }

 private:
  void line(const std::string& tag) { text_ += "  " + tag + "\n"; }
  [[nodiscard]] std::string file(const std::string& name) const { return (folder_.filename() / name).string(); }

  /// Mitsuba's cameras look along +z with x to the left.
  void add_camera(const Camera& camera) {
    const Affine& m = camera.world_from_camera;
    const bool flat = camera.orthographic_height > 0;
    const float half = camera.orthographic_height / 2;
    const Vec3 x = flat ? -m.x * half : -m.x, y = flat ? m.y * half : m.y;
    std::string tag = fmt::format("<sensor type=\"{}\">", flat ? "orthographic" : "perspective");
    if (!flat) {
      tag += fmt::format("<float name=\"fov\" value=\"{}\"/><string name=\"fov_axis\" value=\"y\"/>",
                         camera.vertical_fov_rad * 180 / kPi);
    }
    tag += "<float name=\"near_clip\" value=\"0.001\"/><float name=\"far_clip\" value=\"1e6\"/>";
    tag += matrix_tag(x, y, -m.z, m.origin);
    tag +=
        "<sampler type=\"independent\"><integer name=\"sample_count\" value=\"$samples\"/></sampler>"
        "<film type=\"hdrfilm\"><integer name=\"width\" value=\"$width\"/><integer name=\"height\" value=\"$height\"/>"
        "<string name=\"pixel_format\" value=\"rgb\"/><string name=\"component_format\" value=\"float32\"/>"
        "<rfilter type=\"box\"/></film></sensor>";
    line(tag);
  }

  std::string texture_tag(const char* name, const TextureRef& texture, const std::string& path, bool raw) {
    if (texture.wrap_u != texture.wrap_v)
      warnings_.add("Mitsuba wraps a texture alike both ways; the first way was taken.");
    const char* wrap = texture.wrap_u == Wrap::repeat            ? "repeat"
                       : texture.wrap_u == Wrap::mirrored_repeat ? "mirror"
                                                                 : "clamp";
    return fmt::format(
        "<texture type=\"bitmap\" name=\"{}\"><string name=\"filename\" value={}/><string name=\"wrap_mode\" "
        "value=\"{}\"/><string name=\"filter_type\" value=\"{}\"/>{}</texture>",
        name, quoted(path), wrap, texture.nearest ? "nearest" : "bilinear",
        raw ? "<boolean name=\"raw\" value=\"true\"/>" : "");
  }

  /// A colour, or a colour times a texture.
  std::string colour_tag(const char* name, Vec3 colour, const TextureRef& texture, const std::string& file_name) {
    if (!texture.present()) return rgb_tag(name, colour);
    const TextureImage& image = scene_.images[texture.image];
    if (colour == Vec3{1, 1, 1}) {
      const std::string path = file(fmt::format("image-{}.png", texture.image));
      write_file(folder_ / fmt::format("image-{}.png", texture.image), encode_texture_png(image));
      return texture_tag(name, texture, path, false);
    }
    save_image(folder_ / (file_name + ".exr"), scaled_texture(image, colour));
    return texture_tag(name, texture, file(file_name + ".exr"), true);
  }

  [[nodiscard]] bool has_vertex_colours(std::size_t material) const {
    for (const Mesh& mesh : scene_.meshes) {
      if (mesh.material == material && !mesh.colors.empty()) return true;
    }
    return false;
  }

  void add_material(std::size_t i) {
    const Material& m = scene_.materials[i];
    std::string reflectance =
        colour_tag("reflectance", m.base_color, m.base_color_texture, fmt::format("albedo-{}", i));
    if (has_vertex_colours(i)) {
      if (m.base_color_texture.present() || !(m.base_color == Vec3{1, 1, 1})) {
        warnings_.add(
            "Mitsuba does not multiply vertex colours with a colour or texture; the vertex colours were left out.");
      } else {
        reflectance =
            "<texture type=\"mesh_attribute\" name=\"reflectance\"><string name=\"name\" "
            "value=\"vertex_color\"/></texture>";
      }
    }
    std::string tag = "<bsdf type=\"twosided\"><bsdf type=\"diffuse\">" + reflectance + "</bsdf></bsdf>";
    if (m.alpha_mode == AlphaMode::mask && m.base_color_texture.present()) {
      warnings_.add("Alpha masks are cut out texel by texel in Mitsuba, not along a smooth edge.");
      const std::string name = fmt::format("mask-{}.exr", i);
      save_image(folder_ / name, mask_texture(scene_.images[m.base_color_texture.image], m.alpha, m.alpha_cutoff));
      TextureRef nearest = m.base_color_texture;
      nearest.nearest = true;
      tag = "<bsdf type=\"mask\">" + texture_tag("opacity", nearest, file(name), true) + tag + "</bsdf>";
    }
    line(tag.insert(tag.find('>'), fmt::format(" id=\"material-{}\"", i)));
  }

  void add_shape(std::size_t i) {
    const Instance& instance = scene_.instances[i];
    const Mesh& mesh = scene_.meshes[instance.mesh];
    const Material& material = scene_.materials[mesh.material];
    const std::string name = fmt::format("mesh-{}.ply", i);
    const bool by_emission = !material.base_color_texture.present() && material.emission_texture.present();
    const TextureRef& texture = by_emission ? material.emission_texture : material.base_color_texture;
    PlyWriter(mesh, instance.world_from_object, texture).write(folder_ / name);
    // Mitsuba lets a surface emit about its shading normal, ours emits about the true one.
    const bool emits = max_component(material.emission) > 0;
    std::string tag = fmt::format(
        "<shape type=\"ply\"><string name=\"filename\" value={}/><boolean name=\"face_normals\" "
        "value=\"{}\"/><ref id=\"material-{}\"/>",
        quoted(file(name)), mesh.normals.empty() || emits, mesh.material);
    if (emits) {
      tag += "<emitter type=\"area\">" +
             colour_tag("radiance", material.emission, material.emission_texture,
                        fmt::format("emission-{}", mesh.material)) +
             "</emitter>";
      if (material.double_sided) warnings_.add("Mitsuba's surfaces emit on their front only; the backs stay dark.");
    }
    line(tag + "</shape>");
  }

  void add_point(const PointLight& light) {
    const std::string intensity = rgb_tag("intensity", light.intensity);
    if (light.cos_outer < -1) {
      line(fmt::format("<emitter type=\"point\"><point name=\"position\" x=\"{}\" y=\"{}\" z=\"{}\"/>{}</emitter>",
                       light.position.x, light.position.y, light.position.z, intensity));
      return;
    }
    warnings_.add("Spot lights fade linearly in Mitsuba, where ours fade with the square.");
    const Vec3 to = light.position + light.axis, up = std::abs(light.axis.y) < 0.9f ? Vec3{0, 1, 0} : Vec3{1, 0, 0};
    const auto degrees = [](float cosine) { return std::acos(clamp_to(cosine, -1.0f, 1.0f)) * 180 / kPi; };
    line(fmt::format(
        "<emitter type=\"spot\"><transform name=\"to_world\"><lookat origin=\"{} {} {}\" target=\"{} {} {}\" "
        "up=\"{} {} {}\"/></transform><float name=\"cutoff_angle\" value=\"{}\"/><float name=\"beam_width\" "
        "value=\"{}\"/>{}</emitter>",
        light.position.x, light.position.y, light.position.z, to.x, to.y, to.z, up.x, up.y, up.z,
        degrees(light.cos_outer), degrees(light.cos_inner), intensity));
  }

  void add_environment(const Environment& environment) {
    if (environment.image == nullptr) {
      line("<emitter type=\"constant\">" + rgb_tag("radiance", environment.radiance) + "</emitter>");
      return;
    }
    Image picture = make_rgb_image(environment.image->width, environment.image->height);
    const std::vector<Vec3> pixels = rgb_pixels(*environment.image);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const Vec3 v = pixels[i] * environment.radiance;
      picture.channels[0].values[i] = v.x;
      picture.channels[1].values[i] = v.y;
      picture.channels[2].values[i] = v.z;
    }
    save_image(folder_ / "environment.exr", picture);
    // Mitsuba's picture has -z at its borders, ours in its middle.
    line(fmt::format("<emitter type=\"envmap\"><string name=\"filename\" value={}/>{}</emitter>",
                     quoted(file("environment.exr")), matrix_tag({-1, 0, 0}, {0, 1, 0}, {0, 0, -1}, {})));
  }

  const Scene& scene_;
  std::filesystem::path folder_;
  std::string text_;
  ExportWarnings warnings_;
};

}  // namespace

std::vector<std::string> export_mitsuba(const std::filesystem::path& path, const Scene& scene) {
  MitsubaWriter writer(path, scene);
  save_text(path, writer.text());
  return writer.warnings();
}

}  // namespace lightcuts
