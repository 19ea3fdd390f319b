#pragma once

#include <deque>
#include <string>
#include <vector>

#include "lightcuts/scene.h"

// The interior's furniture. A piece is a few meshes, one a material, that stand on the plane y = 0 about the origin and
// look along +z; it is built once and may be drawn often.

namespace lightcuts {

/// Indices of the interior's materials.
struct Palette {
  std::uint32_t wall, accent_wall, ceiling, planks, tiles, white_paint;          // the room
  std::uint32_t wood, dark_wood, metal, sofa, cushion_a, cushion_b, linen, rug;  // furniture
  std::uint32_t painting, porcelain, glaze, terracotta, leaf, earth, orange, paper;
  std::uint32_t shade, globe;  // what shines
  std::vector<std::uint32_t> books;
};

using Piece = std::vector<Mesh>;

/// Collects parts into one mesh a material.
class Assembly {
 public:
  /// The mesh of a material, begun when first asked for. The reference holds until `take`.
  Mesh& of(std::uint32_t material);
  [[nodiscard]] Piece take(const std::string& name);

 private:
  std::deque<Mesh> meshes_;
};

Piece make_sofa(const Palette& palette);
Piece make_chair(const Palette& palette);
Piece make_dining_table(const Palette& palette);
Piece make_coffee_table(const Palette& palette);
Piece make_bookcase(const Palette& palette);
Piece make_floor_lamp(const Palette& palette);
Piece make_pendant(const Palette& palette);
Piece make_plant(const Palette& palette);
Piece make_picture(const Palette& palette);
Piece make_tea_set(const Palette& palette);
Piece make_fruit_bowl(const Palette& palette);
Piece make_vase(const Palette& palette);

}  // namespace lightcuts
