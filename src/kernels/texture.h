#pragma once

#include "kernels/scene_view.h"

namespace lightcuts {

/// Linear RGB and alpha of a texture.
struct Rgba {
  Vec3 rgb{1, 1, 1};
  float alpha = 1;
};

/// Coordinate of a texel on an axis of `size` texels, for any whole number (as float: coordinates may be huge).
LC_KERNEL std::int32_t wrap_texel(float texel, std::int32_t size, Wrap wrap) {
  const auto n = static_cast<float>(size);
  if (wrap == Wrap::clamp_to_edge) {
    return static_cast<std::int32_t>(clamp_to(texel, 0.0f, n - 1));
  }
  const float period = wrap == Wrap::repeat ? n : 2 * n;
  float within = texel - period * std::floor(texel / period);
  if (wrap == Wrap::mirrored_repeat && within >= n) within = 2 * n - 1 - within;
  return static_cast<std::int32_t>(clamp_to(within, 0.0f, n - 1));
}

LC_KERNEL Rgba texel_at(const SceneView& scene, const ImageView& image, std::int32_t x, std::int32_t y) {
  const std::size_t index =
      static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x);
  const std::uint8_t* t = image.texels + index * static_cast<std::size_t>(image.channels);
  const float* decode = scene.linear_from_srgb;
  Rgba c;
  if (image.channels >= 3) {
    c.rgb = {decode[t[0]], decode[t[1]], decode[t[2]]};
  } else {
    c.rgb = {decode[t[0]], decode[t[0]], decode[t[0]]};
  }
  if (image.channels == 4) c.alpha = static_cast<float>(t[3]) / 255;
  if (image.channels == 2) c.alpha = static_cast<float>(t[1]) / 255;
  return c;
}

/// Where a texture is read: its own coordinates after the material's transform.
LC_KERNEL Vec2 texture_uv(const TextureView& texture, Vec2 uv) {
  const float* m = texture.uv_transform;
  return {m[0] * uv.x + m[1] * uv.y + m[2], m[3] * uv.x + m[4] * uv.y + m[5]};
}

/// Reads a texture at `uv` (before its transform); white and opaque where there is none.
/// Colour is decoded from sRGB before it is filtered.
LC_KERNEL Rgba sample_texture(const SceneView& scene, const TextureView& texture, Vec2 uv) {
  if (texture.image == kNone) return {};
  const ImageView& image = scene.images[texture.image];
  const Vec2 st = texture_uv(texture, uv);
  float x = st.x * static_cast<float>(image.width), y = st.y * static_cast<float>(image.height);
  // Coordinates that are not numbers, or too large for a fraction to exist, read the corner.
  if (!(std::fabs(x) < 1e9f)) x = 0;
  if (!(std::fabs(y) < 1e9f)) y = 0;
  if (texture.nearest) {
    return texel_at(scene, image, wrap_texel(std::floor(x), image.width, texture.wrap_u),
                    wrap_texel(std::floor(y), image.height, texture.wrap_v));
  }
  const float left = std::floor(x - 0.5f), top = std::floor(y - 0.5f);
  const float fx = x - 0.5f - left, fy = y - 0.5f - top;
  const std::int32_t x0 = wrap_texel(left, image.width, texture.wrap_u);
  const std::int32_t x1 = wrap_texel(left + 1, image.width, texture.wrap_u);
  const std::int32_t y0 = wrap_texel(top, image.height, texture.wrap_v);
  const std::int32_t y1 = wrap_texel(top + 1, image.height, texture.wrap_v);
  const Rgba c00 = texel_at(scene, image, x0, y0), c10 = texel_at(scene, image, x1, y0);
  const Rgba c01 = texel_at(scene, image, x0, y1), c11 = texel_at(scene, image, x1, y1);
  const float w00 = (1 - fx) * (1 - fy), w10 = fx * (1 - fy), w01 = (1 - fx) * fy, w11 = fx * fy;
  return {c00.rgb * w00 + c10.rgb * w10 + c01.rgb * w01 + c11.rgb * w11,
          c00.alpha * w00 + c10.alpha * w10 + c01.alpha * w01 + c11.alpha * w11};
}

}  // namespace lightcuts
