#include "io/gltf_images.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <optional>

#include "io/texture_decode.h"

namespace lightcuts::gltf {
namespace {

constexpr std::size_t kMostMissing = 200;

/// Two images with one key have the same bytes.
std::string key_of(const JsonValue& image) {
  if (const JsonValue uri = image.find("uri")) return "uri " + uri.string();
  return fmt::format("view {}", image.require("bufferView").count());
}

void renumber(TextureRef& texture, const std::vector<std::uint32_t>& number) {
  if (texture.present()) texture.image = number[texture.image];
}

}  // namespace

void Images::warn(const JsonValue& where, const std::string& why) {
  const bool located = why.starts_with(context_.document.file());
  if (located) {
    context_.warnings.add(why + " The texture is left out.");
  } else {
    context_.warnings.add_at(where, "picture", why + " The texture is left out.", kMostMissing);
  }
  // Each costs a look at the disk and a sentence: beyond some the file is not worth it.
  if (++missing_ > kMostMissing) {
    where.fail(fmt::format("more than {} pictures of this file cannot be had. {}", kMostMissing, why));
  }
}

Images::Source Images::open(const JsonValue& image) {
  Source source{image, image.name(), {}, {}, 0};
  if (const JsonValue uri = image.find("uri")) {
    if (source.name.empty()) source.name = uri_name(uri.string());
    source.owned = read_uri(uri, context_.folder);
    context_.budget.add_input(source.owned.size());
    source.bytes = source.owned;
  } else {
    source.bytes = buffers_.view(image.require("bufferView")).bytes;
  }
  if (source.name.empty()) source.name = fmt::format("picture {}", sources_.size());
  source.decoded_bytes = read_texture_header(source.bytes, source.name).byte_count();
  return source;
}

std::uint32_t Images::use(const JsonValue& texture) {
  const JsonValue reference = texture.find("source");
  if (!reference) {
    warn(texture, "it has no PNG or JPEG source, only one of an extension. Export the textures as PNG or JPEG.");
    return kNone;
  }
  const JsonValue image = reference.follow(context_.array("images"), "an image");
  const std::string key = key_of(image);
  const auto [entry, is_new] = numbers_.emplace(key, kNone);
  if (!is_new) return entry->second;
  // A scene without one of its pictures is still worth seeing; one that asks for too much memory is not.
  try {
    sources_.push_back(open(image));
  } catch (const Error& error) {
    warn(image, error.what());
    return kNone;
  }
  context_.budget.charge(sources_.back().decoded_bytes, image);
  return entry->second = static_cast<std::uint32_t>(sources_.size() - 1);
}

std::vector<TextureImage> Images::decode(std::vector<Material>& materials) {
  std::vector<TextureImage> decoded(sources_.size());
  std::vector<std::string> failures(sources_.size());
  tbb::parallel_for(std::size_t{0}, sources_.size(), [&](std::size_t i) {
    try {
      decoded[i] = decode_texture(sources_[i].bytes, sources_[i].name);
    } catch (const Error& error) {
      failures[i] = error.what();
    }
    sources_[i].owned = {};
  });
  std::vector<TextureImage> images;
  std::vector<std::uint32_t> number(sources_.size(), kNone);
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    if (!failures[i].empty()) {
      warn(sources_[i].where, failures[i]);
      continue;
    }
    number[i] = static_cast<std::uint32_t>(images.size());
    images.push_back(std::move(decoded[i]));
  }
  for (Material& material : materials) {
    renumber(material.base_color_texture, number);
    renumber(material.emission_texture, number);
  }
  return images;
}

}  // namespace lightcuts::gltf
