#include "lightcuts/render.h"

#include "lightcuts/renderer.h"

namespace lightcuts {

RenderResult render(const Scene& scene, const Camera& camera, const RenderOptions& options,
                    const ProgressFn& progress) {
  return Renderer(scene, options).render(camera, progress);
}

}  // namespace lightcuts
