#include <cstdio>

#include "lightcuts/error.h"
#include "lightcuts/image.h"
#include "lightcuts/io.h"
#include "lightcuts/lights.h"
#include "lightcuts/render.h"
#include "lightcuts/scene.h"
#include "lightcuts/version.h"

int main() {
  const lightcuts::Image image = lightcuts::make_rgb_image(4, 3);
  const auto version = lightcuts::version();
  std::printf("lightcuts %.*s\n", static_cast<int>(version.size()), version.data());
  return image.pixel_count() == 12 ? 0 : 1;
}
