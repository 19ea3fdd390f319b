#include "io/gltf_materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace lightcuts::gltf {
namespace {

/// Blended surfaces become masks: what is rather transparent is not there, what is rather opaque is.
constexpr float kBlendCutoff = 0.5f;

Vec3 read_color(const JsonValue& member, Vec3 value) {
  if (!member) return value;
  std::array<float, 3> rgb{};
  member.numbers(rgb.data(), rgb.size());
  return {rgb[0], rgb[1], rgb[2]};
}

Wrap read_wrap(const JsonValue& member) {
  switch (member.count_or(10497)) {
    case 10497:
      return Wrap::repeat;
    case 33648:
      return Wrap::mirrored_repeat;
    case 33071:
      return Wrap::clamp_to_edge;
    default:
      member.fail("expected 10497 (repeat), 33648 (mirrored repeat) or 33071 (clamp to edge).");
  }
}

/// KHR_texture_transform: scale first, then a rotation (counter-clockwise as seen, v pointing down), then the offset.
std::array<float, 6> read_uv_transform(const JsonValue& transform) {
  std::array<float, 2> offset{0, 0}, scale{1, 1};
  if (const JsonValue member = transform.find("offset")) member.numbers(offset.data(), offset.size());
  if (const JsonValue member = transform.find("scale")) member.numbers(scale.data(), scale.size());
  const auto angle = static_cast<float>(transform.find("rotation").number_or(0));
  const float c = std::cos(angle), s = std::sin(angle);
  return {c * scale[0], s * scale[1], offset[0], -s * scale[0], c * scale[1], offset[1]};
}

bool has_alpha(const TextureImage& image) { return image.channels == 2 || image.channels == 4; }

}  // namespace

std::uint32_t Materials::use(const JsonValue& reference) {
  const auto next = static_cast<std::uint32_t>(materials_.size());
  if (!reference) {
    if (default_ == kNone) {
      default_ = next;
      Material material;
      material.name = "default";
      materials_.push_back(material);
      blended_.emplace_back();
    }
    return default_;
  }
  const JsonValue material = reference.follow(context_.array("materials"), "a material");
  const auto [entry, is_new] = numbers_.emplace(reference.count(), next);
  if (!is_new) return entry->second;
  blended_.emplace_back();
  materials_.push_back(read(material));
  return next;
}

Material Materials::read(const JsonValue& material) {
  Material out;
  out.name = material.name();
  if (out.name.empty()) out.name = fmt::format("material {}", materials_.size());
  read_reflection(material, out);
  read_emission(material, out);
  read_alpha(material, out);
  out.double_sided = material.find("doubleSided").boolean_or(false);
  warn_ignored(material, out);
  return out;
}

void Materials::read_reflection(const JsonValue& material, Material& out) {
  // The old specular-glossiness model says outright what is Lambertian; metallic-roughness calls it base colour.
  const JsonValue glossiness = material.find("extensions").find("KHR_materials_pbrSpecularGlossiness");
  const JsonValue model = glossiness ? glossiness : material.find("pbrMetallicRoughness");
  if (const JsonValue factor = model.find(glossiness ? "diffuseFactor" : "baseColorFactor")) {
    std::array<float, 4> rgba{};
    factor.numbers(rgba.data(), rgba.size());
    out.base_color = {rgba[0], rgba[1], rgba[2]};
    out.alpha = rgba[3];
  }
  out.base_color_texture = read_texture(model.find(glossiness ? "diffuseTexture" : "baseColorTexture"));
  if (glossiness) return;
  // The texture of these two is not read before something uses it: it would double the memory of many scenes.
  out.metallic = static_cast<float>(model.find("metallicFactor").number_or(1));
  out.roughness = static_cast<float>(model.find("roughnessFactor").number_or(1));
}

void Materials::read_emission(const JsonValue& material, Material& out) {
  const JsonValue strength =
      material.find("extensions").find("KHR_materials_emissive_strength").find("emissiveStrength");
  const auto factor = static_cast<float>(strength.number_or(1));
  if (factor < 0)
    context_.warnings.add_at(strength, "negative", "a negative strength was taken for zero.", kToldPlaces);
  const JsonValue member = material.find("emissiveFactor");
  const Vec3 color = read_color(member, {0, 0, 0});
  if (min_component(color) < 0)
    context_.warnings.add_at(member, "negative", "negative components were taken for zero.", kToldPlaces);
  out.emission = max_of(color, Vec3{0, 0, 0}) * std::max(factor, 0.0f);
  // A texture without a factor emits nothing, and need not be decoded.
  if (max_component(out.emission) > 0) out.emission_texture = read_texture(material.find("emissiveTexture"));
}

void Materials::read_alpha(const JsonValue& material, Material& out) {
  const JsonValue member = material.find("alphaMode");
  const std::string mode = member.string_or("OPAQUE");
  if (mode == "MASK") {
    out.alpha_mode = AlphaMode::mask;
    out.alpha_cutoff = static_cast<float>(material.find("alphaCutoff").number_or(0.5));
  } else if (mode == "BLEND") {
    blended_[materials_.size()].wanted = true;
  } else if (mode != "OPAQUE") {
    context_.warnings.add_at(member, "alphaMode", "expected OPAQUE, MASK or BLEND; taken for OPAQUE.", kToldPlaces);
  }
}

TextureRef Materials::read_texture(const JsonValue& info) {
  TextureRef out;
  if (!info) return out;
  const JsonValue transform = info.find("extensions").find("KHR_texture_transform");
  const JsonValue moved = transform.find("texCoord");
  const std::uint64_t texcoord = (moved ? moved : info.find("texCoord")).count_or(0);
  const JsonValue texture = info.require("index").follow(context_.array("textures"), "a texture");
  if (texcoord > 1) {
    context_.warnings.add_at(info, "texCoord",
                             fmt::format("texture coordinates {}: only sets 0 and 1 are "
                                         "read. Textures that use others were left out.",
                                         texcoord));
    return out;
  }
  out.texcoord = static_cast<std::uint8_t>(texcoord);
  if (transform) out.uv_transform = read_uv_transform(transform);
  if (const JsonValue reference = texture.find("sampler")) {
    const JsonValue sampler = reference.follow(context_.array("samplers"), "a sampler");
    out.wrap_u = read_wrap(sampler.find("wrapS"));
    out.wrap_v = read_wrap(sampler.find("wrapT"));
    out.nearest = sampler.find("magFilter").count_or(9729) == 9728;
  }
  out.image = images_.use(texture);
  return out;
}

void Materials::warn_ignored(const JsonValue& material, const Material& out) {
  const std::string& file = context_.document.file();
  const auto ignored = [&](const char* what) {
    context_.warnings.add(
        fmt::format("{}: {} of materials is ignored until glossy reflection lands; all surfaces "
                    "are Lambertian with their base colour.",
                    file, what));
  };
  if (!material.find("extensions").find("KHR_materials_pbrSpecularGlossiness")) {
    if (out.metallic > 0) ignored("metalness");
    if (out.roughness < 1) ignored("gloss (roughness below 1)");
  }
  if (material.find("normalTexture")) {
    context_.warnings.add(fmt::format("{}: normal maps are not used; surfaces are as smooth as their geometry.", file));
  }
}

void Materials::settle_blending(std::vector<Material>& materials, const std::vector<TextureImage>& images) {
  std::size_t blended = 0;
  for (std::size_t i = 0; i < materials.size(); ++i) {
    if (!blended_[i].wanted) continue;
    ++blended;
    Material& material = materials[i];
    const TextureRef& texture = material.base_color_texture;
    const bool varies =
        material.alpha < 1 || blended_[i].by_vertex || (texture.present() && has_alpha(images[texture.image]));
    if (!varies) continue;
    material.alpha_mode = AlphaMode::mask;
    material.alpha_cutoff = kBlendCutoff;
  }
  if (blended == 0) return;
  context_.warnings.add(fmt::format(
      "{}: blended transparency is drawn as a mask: surfaces are there where alpha is at least {} (materials "
      "that ask for blending: {}).",
      context_.document.file(), kBlendCutoff, blended));
}

}  // namespace lightcuts::gltf
