#include "cpu/ism/fill_holes.h"

#include <algorithm>

namespace lightcuts {
namespace {

/// A map and its coarser levels. Most texels hold a depth, so that the coarser ones are found only where a hole asks.
template <class Depth>
class Pyramid {
 public:
  Pyramid(Depth* map, int size, int levels, HoleFill fill, FillScratch<Depth>& scratch)
      : map_(map), size_(size), apart_(fill == HoleFill::edges), scratch_(scratch) {
    scratch.coarser.resize(std::max(scratch.coarser.size(), static_cast<std::size_t>(levels)));
    int side = size;
    while (count_ < levels && side > 1) {
      side = (side + 1) / 2;
      typename FillScratch<Depth>::Level& level = scratch.coarser[static_cast<std::size_t>(count_++)];
      const auto texels = static_cast<std::size_t>(side) * static_cast<std::size_t>(side);
      level.size = side;
      level.pulled.resize(std::max(level.pulled.size(), texels));
      level.pushed.resize(std::max(level.pushed.size(), texels));
      level.known.assign(std::max(level.known.size(), texels), 0);
    }
  }

  void fill() {
    if (count_ == 0) return;
    scratch_.holes.clear();
    const int half = (size_ + 1) / 2;
    for (int y = 0; y < half; ++y) {
      for (int x = 0; x < half; ++x) look_for_holes(x, y);
    }
    // Only now: coarser texels are means of what was drawn.
    for (const auto& hole : scratch_.holes) map_[hole.texel] = hole.code;
  }

 private:
  /// Of the four texels that a coarser one stands for.
  void look_for_holes(int coarse_x, int coarse_y) {
    const int end_x = std::min(2 * coarse_x + 2, size_), end_y = std::min(2 * coarse_y + 2, size_);
    for (int y = 2 * coarse_y; y < end_y; ++y) {
      for (int x = 2 * coarse_x; x < end_x; ++x) {
        const auto texel = static_cast<std::uint32_t>(y * size_ + x);
        if (map_[texel] != kNoDepth<Depth>) continue;
        if (pushed(1, coarse_x, coarse_y) == kNoDepth<Depth>) return;
        const Depth code =
            push_at<Depth>(x, y, fill_rule<Depth>(apart_, 0), [this](int i, int j) { return pushed(1, i, j); });
        scratch_.holes.push_back({texel, code});
      }
    }
  }

  Depth pulled(int at, int x, int y) {
    if (at == 0) {
      const bool inside = x >= 0 && y >= 0 && x < size_ && y < size_;
      return inside ? map_[y * size_ + x] : kNoDepth<Depth>;
    }
    typename FillScratch<Depth>::Level& level = scratch_.coarser[static_cast<std::size_t>(at - 1)];
    if (x < 0 || y < 0 || x >= level.size || y >= level.size) return kNoDepth<Depth>;
    const auto texel = static_cast<std::size_t>(y * level.size + x);
    if ((level.known[texel] & 1u) == 0) {
      level.pulled[texel] = pull_at<Depth>(x, y, fill_rule<Depth>(apart_, at - 1),
                                           [this, at](int i, int j) { return pulled(at - 1, i, j); });
      level.known[texel] |= 1u;
    }
    return level.pulled[texel];
  }

  Depth pushed(int at, int x, int y) {
    if (at == count_) return pulled(at, x, y);
    typename FillScratch<Depth>::Level& level = scratch_.coarser[static_cast<std::size_t>(at - 1)];
    if (x < 0 || y < 0 || x >= level.size || y >= level.size) return kNoDepth<Depth>;
    const auto texel = static_cast<std::size_t>(y * level.size + x);
    if ((level.known[texel] & 2u) == 0) {
      Depth code = pulled(at, x, y);
      if (code == kNoDepth<Depth>) {
        code = push_at<Depth>(x, y, fill_rule<Depth>(apart_, at),
                              [this, at](int i, int j) { return pushed(at + 1, i, j); });
      }
      level.pushed[texel] = code;
      level.known[texel] |= 2u;
    }
    return level.pushed[texel];
  }

  Depth* map_;
  int size_, count_ = 0;
  bool apart_;
  FillScratch<Depth>& scratch_;
};

}  // namespace

template <class Depth>
void fill_holes(Depth* map, int size, int levels, HoleFill fill, FillScratch<Depth>& scratch) {
  Pyramid<Depth>(map, size, levels, fill, scratch).fill();
}

template void fill_holes(std::uint16_t*, int, int, HoleFill, FillScratch<std::uint16_t>&);
template void fill_holes(std::uint32_t*, int, int, HoleFill, FillScratch<std::uint32_t>&);

}  // namespace lightcuts
