#include "io/obj_materials.h"

#include <fmt/format.h>

#include <map>
#include <set>
#include <utility>

#include "io/obj_mtl.h"
#include "io/read_file.h"
#include "io/texture_decode.h"
#include "lightcuts/error.h"

namespace lightcuts::obj {
namespace {

namespace fs = std::filesystem;
using Warnings = std::vector<std::string>;

constexpr Vec3 kGrey{0.8f, 0.8f, 0.8f};
constexpr std::uint64_t kMaxTextureFile = std::uint64_t{1} << 30;

/// The files of an `mtllib` line: one name with spaces in it, or several names; "\ " is a space within a name.
std::vector<std::string> library_names(const std::string& text) {
  std::vector<std::string> names(1);
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool escaped = text[i] == '\\' && i + 1 < text.size() && text[i + 1] == ' ';
    if (escaped) ++i;
    if (!escaped && (text[i] == ' ' || text[i] == '\t')) {
      if (!names.back().empty()) names.emplace_back();
    } else {
      names.back().push_back(text[i]);
    }
  }
  if (names.back().empty()) names.pop_back();
  return names;
}

class Library {
 public:
  Library(const fs::path& folder, Warnings& warnings) : folder_(folder), warnings_(warnings) {}

  /// Reads the files of an `mtllib` line.
  void read(const std::string& text) {
    if (fs::path whole = find_beside(folder_, text); !whole.empty()) {
      read_file(whole);
      return;
    }
    for (const std::string& name : library_names(text)) {
      const fs::path path = find_beside(folder_, name);
      if (path.empty()) {
        missing_.insert(name);
      } else {
        read_file(path);
      }
    }
  }

  /// Says which files were missing; only the first few, a file may name any number.
  void report() {
    constexpr std::size_t kMaxNamed = 5;
    std::size_t named = 0;
    for (const std::string& name : missing_) {
      if (++named > kMaxNamed) break;
      warnings_.push_back(
          fmt::format("{}: there is no such material library in the scene's folder.", name.substr(0, 200)));
    }
    if (missing_.size() > kMaxNamed) {
      warnings_.push_back(fmt::format("{} more material libraries are missing.", missing_.size() - kMaxNamed));
    }
  }

  const MtlMaterial* find(const std::string& name) const {
    const auto found = materials_.find(name);
    return found == materials_.end() ? nullptr : &found->second;
  }

 private:
  void read_file(const fs::path& path) {
    if (!read_.insert(path).second) return;
    Notes notes(path.string());
    try {
      for (MtlMaterial& material : parse_mtl(path, notes)) {
        const std::string name = material.name;
        if (!materials_.try_emplace(name, std::move(material)).second) {
          warnings_.push_back(fmt::format("{}: the material \"{}\" is defined more than once; the first one counts.",
                                          path.string(), name));
        }
      }
    } catch (const Error& e) {
      warnings_.emplace_back(e.what());
    }
    notes.append_to(warnings_);
  }

  const fs::path& folder_;
  Warnings& warnings_;
  std::set<fs::path> read_;
  std::set<std::string> missing_;
  std::map<std::string, MtlMaterial> materials_;
};

/// Loads each picture once.
class Textures {
 public:
  Textures(const fs::path& folder, Scene& scene, Warnings& warnings)
      : folder_(folder), scene_(scene), warnings_(warnings) {}

  /// Index of the picture, kNone (with a warning) if there is none that can be read.
  std::uint32_t load(const MtlMap& map) {
    if (!map.present()) return kNone;
    const fs::path path = find(map.text);
    if (path.empty()) {
      if (named_.insert(map.text).second) {
        warnings_.push_back(fmt::format("{}: there is no such texture in the scene's folder; the surface goes without.",
                                        map.text.substr(0, 200)));
      }
      return kNone;
    }
    const auto [found, added] = loaded_.try_emplace(path, kNone);
    if (added) found->second = decode(path);
    return found->second;
  }

  /// A picture with the colours of `color` (white if kNone) and the opacity that `mask` has as its alpha, or else as its
  /// grey.
  std::uint32_t with_alpha(std::uint32_t color, std::uint32_t mask) {
    if (mask == kNone || (mask == color && has_alpha(mask))) return color;
    const auto [found, added] = masked_.try_emplace({color, mask}, kNone);
    if (added) found->second = combine(color, mask);
    return found->second;
  }

 private:
  /// The name as it stands there, or what comes before options that some exporters write behind it.
  [[nodiscard]] fs::path find(const std::string& text) const {
    fs::path path = find_beside(folder_, text);
    const std::size_t option = text.find(" -");
    if (path.empty() && option != std::string::npos) path = find_beside(folder_, text.substr(0, option));
    return path;
  }

  std::uint32_t decode(const fs::path& path) {
    try {
      TextureImage image = decode_texture(read_file(path, kMaxTextureFile), path.string());
      return add(std::move(image));
    } catch (const Error& e) {
      warnings_.push_back(fmt::format("{} The surface goes without this texture.", e.what()));
      return kNone;
    }
  }

  std::uint32_t add(TextureImage image) {
    scene_.images.push_back(std::move(image));
    return static_cast<std::uint32_t>(scene_.images.size() - 1);
  }

  [[nodiscard]] bool has_alpha(std::uint32_t image) const { return scene_.images[image].channels % 2 == 0; }

  std::uint32_t combine(std::uint32_t color, std::uint32_t mask) {
    const TextureImage& alpha = scene_.images[mask];
    const TextureImage& base = scene_.images[color == kNone ? mask : color];
    TextureImage result;
    result.name = fmt::format("{} with the opacity of {}", color == kNone ? "white" : base.name, alpha.name);
    result.width = base.width;
    result.height = base.height;
    result.channels = 4;
    result.texels.reserve(std::size_t{4} * base.width * base.height);
    const auto alpha_channels = static_cast<std::size_t>(alpha.channels);
    const std::size_t alpha_offset = has_alpha(mask) ? alpha_channels - 1 : 0;
    const auto base_channels = static_cast<std::size_t>(base.channels);
    for (std::int64_t y = 0; y < base.height; ++y) {
      const std::int64_t alpha_y = y * alpha.height / base.height;
      for (std::int64_t x = 0; x < base.width; ++x) {
        const auto texel = static_cast<std::size_t>(y * base.width + x) * base_channels;
        for (std::size_t c = 0; c < 3; ++c) {
          result.texels.push_back(color == kNone ? std::uint8_t{255}
                                                 : base.texels[texel + (base_channels < 3 ? 0 : c)]);
        }
        const std::int64_t alpha_x = x * alpha.width / base.width;
        result.texels.push_back(
            alpha.texels[static_cast<std::size_t>(alpha_y * alpha.width + alpha_x) * alpha_channels + alpha_offset]);
      }
    }
    return add(std::move(result));
  }

  const fs::path& folder_;
  Scene& scene_;
  Warnings& warnings_;
  std::map<fs::path, std::uint32_t> loaded_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> masked_;
  std::set<std::string> named_;
};

/// -s and -o scale and shift coordinates whose v points up: v' = 1 - (s (1 - v) + o).
TextureRef texture_ref(std::uint32_t image, const MtlMap& map) {
  TextureRef ref;
  ref.image = image;
  ref.wrap_u = ref.wrap_v = map.clamp ? Wrap::clamp_to_edge : Wrap::repeat;
  const auto [su, sv] = map.scale;
  const auto [ou, ov] = map.offset;
  ref.uv_transform = {su, 0, ou, 0, sv, 1 - sv - ov};
  return ref;
}

bool is_black(Vec3 color) { return max_component(color) <= 0; }

/// The factor of a texture: many exporters leave it out or write black beside one.
Vec3 factor(const std::optional<Vec3>& color, bool textured, Vec3 otherwise) {
  if (textured && (!color || is_black(*color))) return {1, 1, 1};
  return color.value_or(otherwise);
}

/// A surface is there or it is not: without refraction, opacity below one half is taken as "not there" by an alpha mask
/// with the cutoff 0.5, which also cuts out leaves and fences by their map_d.
void set_opacity(const MtlMaterial& source, Textures& textures, Material& material) {
  const float opacity = source.opacity.value_or(1.0f);
  const std::uint32_t mask = textures.load(source.map_d);
  if (opacity >= 0.5f && mask == kNone) return;
  material.alpha_mode = AlphaMode::mask;
  material.alpha_cutoff = 0.5f;
  // Some exporters write d 0 beside map_d; the map then says all.
  material.alpha = mask != kNone ? 1.0f : opacity;
  if (mask == kNone) return;
  const bool has_color = material.base_color_texture.present();
  const std::uint32_t image = textures.with_alpha(material.base_color_texture.image, mask);
  material.base_color_texture = has_color ? material.base_color_texture : texture_ref(image, source.map_d);
  material.base_color_texture.image = image;
}

Material make_material(const MtlMaterial& source, Textures& textures) {
  Material material;
  const std::uint32_t color = textures.load(source.map_kd);
  if (color != kNone) material.base_color_texture = texture_ref(color, source.map_kd);
  material.base_color = factor(source.kd, color != kNone, kGrey);

  const std::uint32_t emission = textures.load(source.map_ke);
  if (emission != kNone) material.emission_texture = texture_ref(emission, source.map_ke);
  material.emission = factor(source.ke, emission != kNone, {0, 0, 0});

  material.metallic = source.metallic.value_or(material.metallic);
  material.roughness = source.roughness.value_or(material.roughness);
  set_opacity(source, textures, material);
  return material;
}

}  // namespace

void add_materials(const Data& data, const fs::path& folder, Scene& scene, Warnings& warnings) {
  Library library(folder, warnings);
  for (const std::string& text : data.libraries) library.read(text);
  library.report();

  Textures textures(folder, scene, warnings);
  std::size_t unknown_count = 0;
  std::string first_unknown;
  for (const std::string& name : data.material_names) {
    Material material;
    material.base_color = kGrey;
    if (const MtlMaterial* found = library.find(name)) {
      material = make_material(*found, textures);
    } else if (!name.empty() && unknown_count++ == 0) {
      first_unknown = name.substr(0, 200);
    }
    material.name = name.empty() ? "default" : name;
    scene.materials.push_back(std::move(material));
  }
  if (unknown_count > 0) {
    const std::string more = unknown_count > 1 ? fmt::format(" and {} more", unknown_count - 1) : "";
    warnings.push_back(fmt::format("The material \"{}\"{} is in no material library: its surfaces are light grey.",
                                   first_unknown, more));
  }
}

}  // namespace lightcuts::obj
