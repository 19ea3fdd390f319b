#pragma once

#include <cstdint>
#include <memory>

#include "lightcuts/render.h"

namespace lightcuts {

/// How often stages ran for a Renderer's pictures, and how many shadow maps were drawn.
struct StageRuns {
  std::uint64_t acceleration_structures = 0, vpls = 0, light_trees = 0, surface_points = 0, shadow_maps = 0,
                pictures = 0;
};

/// Renders pictures of one scene, and keeps on the GPU, or in the processor's memory, what the next one can use.
///
/// Each picture is to the bit that of `render` with the same scene, camera and options, whatever was rendered before.
/// Before a picture, what depends on a change is remade and nothing else:
///
/// - another camera or another size of the picture: cuts and shading. With VplPlacement::camera also VPLs and light
///   trees, as they follow the camera.
/// - lights, emission, reflectances or environment (after `lights_changed`), or VplOptions: VPLs, light trees, cuts and
///   shading. With shadow maps also the maps of those lights that stand elsewhere now; on a GPU also of those that no cut of
///   the last pictures used.
/// - TreeOptions: light trees, cuts and shading.
/// - ShadeOptions: cuts and shading. Shadow maps and the points that they are drawn from where an option of theirs or the seed
///   changed, or where the memory budget is too small to keep them; on a CPU also where all lights together have more
///   than 256 MiB of maps and no cuts choose among them.
/// - geometry or textures (after `scene_changed`), backend, device, memory or threads: everything.
///
/// Not for several threads at once.
class Renderer {
 public:
  /// The scene must have passed `validate` and outlive this.
  /// Throws Error{no_emitter, invalid_argument}.
  explicit Renderer(const Scene& scene, const RenderOptions& options = {});
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  /// Of the next pictures. Throws Error{invalid_argument}, and keeps the old ones then.
  void set_options(const RenderOptions& options);

  /// The scene's lights, its environment, or emission and reflectances of its materials were changed in place; geometry,
  /// textures and alpha masks were not. Throws Error{no_emitter}.
  void lights_changed();

  /// Anything in the scene was changed in place; it must have passed `validate` again. Throws Error{no_emitter}.
  void scene_changed();

  /// Renders one picture. Times of stages that were not run are 0 in its statistics.
  /// Throws Error{no_emitter, invalid_argument, out_of_memory, no_device, not_built}; the next picture starts anew then.
  RenderResult render(const Camera& camera, const ProgressFn& progress = {});

  /// Since this was made.
  [[nodiscard]] StageRuns runs() const;

 private:
  class State;
  std::unique_ptr<State> state_;
};

}  // namespace lightcuts
