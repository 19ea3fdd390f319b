#include "cpu/ism/fill_holes.h"

#include <algorithm>

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
void pull(Level<Depth> fine, Level<Depth> coarse, const FillRule& rule) {
  const auto at = [&fine](int x, int y) { return fine.at(x, y); };
  for (int y = 0; y < coarse.size; ++y) {
    Depth* out = coarse.row(y);
    for (int x = 0; x < coarse.size; ++x) out[x] = pull_at<Depth>(x, y, rule, at);
  }
}

template <class Depth>
void push(Level<Depth> coarse, Level<Depth> fine, const FillRule& rule) {
  const auto at = [&coarse](int x, int y) { return coarse.at(x, y); };
  for (int y = 0; y < fine.size; ++y) {
    Depth* out = fine.row(y);
    for (int x = 0; x < fine.size; ++x) {
      if (out[x] == kNoDepth<Depth>) out[x] = push_at<Depth>(x, y, rule, at);
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
    pull(fine, pyramid.back(), fill_rule<Depth>(fill == HoleFill::edges, level));
  }
  for (std::size_t level = pyramid.size() - 1; level > 0; --level) {
    push(pyramid[level], pyramid[level - 1], fill_rule<Depth>(fill == HoleFill::edges, static_cast<int>(level) - 1));
  }
}

template void fill_holes(std::uint16_t*, int, int, HoleFill, FillScratch<std::uint16_t>&);
template void fill_holes(std::uint32_t*, int, int, HoleFill, FillScratch<std::uint32_t>&);

}  // namespace lightcuts
