#pragma once

#include "lightcuts/scene.h"

// Pictures painted by code: what the interior's materials sample. All but the painting tile.

namespace lightcuts {

TextureImage wood_planks();  ///< 2.4 x 2.4 m of floor boards along v
TextureImage wood_grain();   ///< 1.2 x 1.2 m of plain wood, grain along u
TextureImage floor_tiles();  ///< 0.6 x 0.6 m: four stone tiles with joints
TextureImage plaster();      ///< 2 x 2 m of hand-smoothed white
TextureImage linen();        ///< 0.1 x 0.1 m of woven grey-white cloth, to be tinted by the base colour
TextureImage rug();          ///< the whole rug, once
TextureImage painting();     ///< a landscape, once

}  // namespace lightcuts
