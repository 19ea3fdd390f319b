#include "cpu/ism/fill_holes.h"

#include <algorithm>
#include <limits>

#include "kernels/pull_push.h"

namespace lightcuts {
namespace {

/// A square of codes; whatever lies outside is empty.
template <class Depth>
struct Level {
  Depth* codes;
  int size;

  [[nodiscard]] Depth at(int x, int y) const {
    const bool inside = x >= 0 && y >= 0 && x < size && y < size;
    return inside ? codes[static_cast<std::size_t>(y) * static_cast<std::size_t>(size) + static_cast<std::size_t>(x)]
                  : kNoDepth<Depth>;
  }
  [[nodiscard]] Depth* row(int y) const { return codes + static_cast<std::size_t>(y) * static_cast<std::size_t>(size); }
};

template <class Depth>
std::uint64_t threshold_of(int level, HoleFill fill) {
  if (fill == HoleFill::mean) return std::numeric_limits<std::uint32_t>::max();
  return static_cast<std::uint64_t>(kFillThreshold * static_cast<double>(kDepthSteps<Depth>)) << std::min(level, 8);
}

template <class Depth>
void pull(Level<Depth> fine, Level<Depth> coarse, HoleFill fill, std::uint64_t threshold) {
  const int least = fill == HoleFill::mean ? 1 : kFillLeast;
  for (int y = 0; y < coarse.size; ++y) {
    Depth* out = coarse.row(y);
    for (int x = 0; x < coarse.size; ++x) {
      out[x] = pull_texel(fine.at(2 * x, 2 * y), fine.at(2 * x + 1, 2 * y), fine.at(2 * x, 2 * y + 1),
                          fine.at(2 * x + 1, 2 * y + 1), threshold, least);
    }
  }
}

template <class Depth>
void push(Level<Depth> coarse, Level<Depth> fine, HoleFill fill, std::uint64_t threshold) {
  for (int y = 0; y < fine.size; ++y) {
    Depth* out = fine.row(y);
    const int py = y / 2, beside_y = py + (y % 2 == 0 ? -1 : 1);
    for (int x = 0; x < fine.size; ++x) {
      if (out[x] != kNoDepth<Depth>) continue;
      const int px = x / 2, beside_x = px + (x % 2 == 0 ? -1 : 1);
      out[x] = fill == HoleFill::mean
                   ? push_texel(out[x], coarse.at(px, py))
                   : push_texel_smooth(out[x], coarse.at(px, py), coarse.at(beside_x, py), coarse.at(px, beside_y),
                                       coarse.at(beside_x, beside_y), threshold);
    }
  }
}

}  // namespace

template <class Depth>
void fill_holes(Depth* map, int size, int levels, HoleFill fill, FillScratch<Depth>& scratch) {
  if (levels <= 0) return;
  const auto texels = static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
  if (std::find(map, map + texels, kNoDepth<Depth>) == map + texels) return;
  scratch.coarser.resize(std::max(scratch.coarser.size(), static_cast<std::size_t>(levels)));

  std::vector<Level<Depth>> pyramid{{map, size}};
  for (int level = 0; level < levels && pyramid.back().size > 1; ++level) {
    const Level<Depth> fine = pyramid.back();
    const int half = (fine.size + 1) / 2;
    std::vector<Depth>& codes = scratch.coarser[static_cast<std::size_t>(level)];
    codes.resize(static_cast<std::size_t>(half) * static_cast<std::size_t>(half));
    pyramid.push_back({codes.data(), half});
    pull(fine, pyramid.back(), fill, threshold_of<Depth>(level, fill));
  }
  for (std::size_t level = pyramid.size() - 1; level > 0; --level) {
    push(pyramid[level], pyramid[level - 1], fill, threshold_of<Depth>(static_cast<int>(level) - 1, fill));
  }
}

template void fill_holes(std::uint16_t*, int, int, HoleFill, FillScratch<std::uint16_t>&);
template void fill_holes(std::uint32_t*, int, int, HoleFill, FillScratch<std::uint32_t>&);

}  // namespace lightcuts
