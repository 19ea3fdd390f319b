#include "scene/builtin/textures.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <cstdint>

// Colours here are sRGB-encoded, as a painter mixes them.

namespace lightcuts {
namespace {

/// A number in [0, 1) from two whole numbers: the mixing steps of MurmurHash3's finaliser.
float hash01(int x, int y) {
  auto h = static_cast<std::uint32_t>(x) * 0x9e3779b1u + static_cast<std::uint32_t>(y) * 0x85ebca77u + 0x27220a95u;
  h = (h ^ (h >> 16)) * 0x85ebca6bu;
  h = (h ^ (h >> 13)) * 0xc2b2ae35u;
  return static_cast<float>((h ^ (h >> 16)) >> 8) * 0x1p-24f;
}

float mix(float a, float b, float t) { return a + (b - a) * t; }
Vec3 mix(Vec3 a, Vec3 b, float t) { return a + (b - a) * t; }
float smooth(float lo, float hi, float x) {
  const float t = clamp_to((x - lo) / (hi - lo), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

/// Value noise in [0, 1] that repeats every `period_x`, `period_y` lattice cells.
float noise(float x, float y, int period_x, int period_y) {
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const float fx = smooth(0, 1, x - static_cast<float>(x0)), fy = smooth(0, 1, y - static_cast<float>(y0));
  const auto at = [&](int i, int j) {
    return hash01(((x0 + i) % period_x + period_x) % period_x, ((y0 + j) % period_y + period_y) % period_y);
  };
  return mix(mix(at(0, 0), at(1, 0), fx), mix(at(0, 1), at(1, 1), fx), fy);
}

/// Four octaves of it, in [0, 1]; u and v run over the unit square.
float fractal(float u, float v, int cells_u, int cells_v) {
  float sum = 0, weight = 0.5f;
  for (int octave = 0; octave < 4; ++octave, cells_u *= 2, cells_v *= 2, weight /= 2) {
    sum += weight * noise(u * static_cast<float>(cells_u), v * static_cast<float>(cells_v), cells_u, cells_v);
  }
  return sum / 0.9375f;
}

/// Paints every texel's middle by a function of the unit square, v downwards.
template <class Paint>
TextureImage paint(const char* name, int width, int height, Paint color) {
  TextureImage image{name, width, height, 3, {}};
  image.texels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
  tbb::parallel_for(0, height, [&](int y) {
    std::uint8_t* texel = image.texels.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width) * 3;
    for (int x = 0; x < width; ++x) {
      const Vec3 c = color((static_cast<float>(x) + 0.5f) / static_cast<float>(width),
                           (static_cast<float>(y) + 0.5f) / static_cast<float>(height));
      for (const float channel : {c.x, c.y, c.z}) {
        *texel++ = static_cast<std::uint8_t>(std::lround(clamp_to(channel, 0.0f, 1.0f) * 255));
      }
    }
  });
  return image;
}

/// Grain of a board: fine fibres and wide rings along u, shifted by a number of its own.
float grain(float u, float v, int board) {
  const float shift = static_cast<float>(board % 64) * 3.17f;
  const float rings = 0.5f + 0.5f * std::sin(18 * v + 5 * fractal(u, v, 2, 3) + shift);
  const float fibres = noise(u * 24 + shift, v * 400, 64, 400);
  return 0.6f * rings + 0.4f * fibres;
}

}  // namespace

TextureImage wood_planks() {
  constexpr int kRows = 16;
  return paint("wood planks", 1024, 1024, [](float across, float along) {
    const float row_place = across * kRows;
    const int row = static_cast<int>(row_place);
    const float moved = along * 2 + hash01(row, 7);
    const int board = static_cast<int>(std::floor(moved)) % 2 * 31 + row * 2;
    const float edge_across = std::fabs(row_place - static_cast<float>(row) - 0.5f);
    const float edge_along = std::fabs(moved - std::floor(moved) - 0.5f);
    const float joint = std::fmax(smooth(0.485f, 0.497f, edge_across), smooth(0.4985f, 0.4995f, edge_along));
    const Vec3 tone = mix(Vec3{0.66f, 0.49f, 0.33f}, {0.80f, 0.63f, 0.45f}, hash01(board, 3));
    const Vec3 dark = tone * 0.86f;
    const Vec3 color = mix(dark, tone, grain(along, across * 6 + hash01(board, 5), board));
    return mix(color, color * 0.55f, joint);
  });
}

TextureImage wood_grain() {
  return paint("wood grain", 512, 512, [](float u, float v) {
    const float t = 0.55f * fractal(u, v, 2, 12) + 0.45f * fractal(u, v, 4, 64);
    return mix(Vec3{0.50f, 0.33f, 0.20f}, {0.70f, 0.50f, 0.33f}, t);
  });
}

TextureImage floor_tiles() {
  return paint("floor tiles", 512, 512, [](float u, float v) {
    const int column = static_cast<int>(u * 2), row = static_cast<int>(v * 2);
    const float x = std::fabs(u * 2 - static_cast<float>(column) - 0.5f);
    const float y = std::fabs(v * 2 - static_cast<float>(row) - 0.5f);
    const float joint = smooth(0.485f, 0.492f, std::fmax(x, y));
    const float tone = 0.9f + 0.06f * hash01(column, row) + 0.12f * (fractal(u, v, 5, 5) - 0.5f);
    return mix(Vec3{0.62f, 0.60f, 0.57f} * tone, {0.48f, 0.46f, 0.44f}, joint);
  });
}

TextureImage plaster() {
  return paint("plaster", 512, 512, [](float u, float v) {
    const float t = 0.7f * fractal(u, v, 3, 3) + 0.3f * fractal(u, v, 32, 32);
    return Vec3{1, 1, 1} * (0.955f + 0.045f * t);
  });
}

TextureImage linen() {
  return paint("linen", 128, 128, [](float u, float v) {
    constexpr int kThreads = 24;
    const float warp = std::fabs(std::sin(kPi * kThreads * u)), weft = std::fabs(std::sin(kPi * kThreads * v));
    const float over = noise(u * kThreads, v * kThreads, kThreads, kThreads);
    return Vec3{1, 1, 1} * (0.92f + 0.05f * std::fmax(warp, weft) + 0.03f * over);
  });
}

TextureImage rug() {
  return paint("rug", 768, 512, [](float u, float v) {
    const Vec3 cream{0.88f, 0.83f, 0.73f}, navy{0.20f, 0.27f, 0.38f}, rust{0.71f, 0.36f, 0.24f},
        ochre{0.83f, 0.62f, 0.33f};
    const float x = u * 1.5f, y = v;  // the rug is 3 : 2
    const float edge = std::fmin(std::fmin(x, 1.5f - x), std::fmin(y, 1 - y));
    Vec3 color = cream;
    if (edge < 0.035f) {
      color = navy;
    } else if (edge < 0.05f) {
      color = cream;
    } else if (edge < 0.085f) {
      color = rust;
    } else if (edge > 0.11f) {
      // Lozenges in four rings.
      const float cell_x = std::fabs(std::fmod(x * 4, 1.0f) - 0.5f), cell_y = std::fabs(std::fmod(y * 4, 1.0f) - 0.5f);
      const float ring = cell_x + cell_y;
      const bool odd = (static_cast<int>(x * 4) + static_cast<int>(y * 4)) % 2 != 0;
      if (ring < 0.12f) color = odd ? rust : navy;
      if (ring > 0.22f && ring < 0.30f) color = odd ? navy : ochre;
      if (ring > 0.40f && ring < 0.45f) color = rust;
    }
    const float pile = 0.5f * noise(u * 384, v * 256, 384, 256) + 0.5f * fractal(u, v, 9, 6);
    return color * (0.86f + 0.16f * pile);
  });
}

TextureImage painting() {
  return paint("painting", 640, 480, [](float u, float v) {
    Vec3 color = mix(Vec3{0.55f, 0.68f, 0.76f}, {0.96f, 0.83f, 0.66f}, smooth(0.0f, 0.65f, v));
    const float dx = (u - 0.66f) * 4 / 3, dy = v - 0.36f;
    color = mix(color, {0.97f, 0.93f, 0.80f}, 1 - smooth(0.105f, 0.11f, std::sqrt(dx * dx + dy * dy)));
    // Ranges of hills, the nearer the darker.
    const Vec3 hills[] = {{0.72f, 0.66f, 0.66f}, {0.78f, 0.52f, 0.40f}, {0.42f, 0.50f, 0.47f}, {0.20f, 0.30f, 0.36f}};
    for (int i = 0; i < 4; ++i) {
      const auto k = static_cast<float>(i);
      const float crest = 0.50f + 0.12f * k + 0.05f * std::sin(u * (5 + 2 * k) + 2.1f * k) +
                          0.03f * std::sin(u * (13 - 2 * k) + 0.7f * k);
      color = mix(color, hills[i], smooth(crest, crest + 0.004f, v));
    }
    return color * (0.93f + 0.1f * fractal(u, v, 16, 60));
  });
}

}  // namespace lightcuts
