#pragma once

#include "cpu/ism/shadow_map_set.h"
#include "cpu/shade_picture.h"
#include "cpu/simd/shade_kernels.h"
#include "lightcuts/render.h"

namespace lightcuts {

/// What lighting by maps needs. Everything referred to must outlive the call.
struct MapLighting {
  const TileSource& source;
  const LightSet& lights;
  const ShadeKernels& shade;
  const IsmKernels& ism;
  const ShadeOptions& options;
  float min_distance;          ///< clamp of the VPL singularity [m]
  std::uint64_t memory_bytes;  ///< left for points and maps, 0: no limit
};

/// Points and maps of any light, made when a cut first looks one up.
class LightMaps {
 public:
  /// Makes the points. Throws Error{out_of_memory} before anything is allocated.
  LightMaps(const MapLighting& lighting, Statistics& statistics);
  [[nodiscard]] const PacketVisibility* visibility() const { return &visibility_; }
  /// Tells `statistics` of the maps that were made.
  void report(Statistics& statistics) const;

 private:
  SurfacePoints points_;
  ShadowMapSet maps_;
  ShadowMapsOnDemand visibility_;
};

PointOptions point_options(const ShadeOptions& options);
ShadowMapOptions shadow_map_options(const ShadeOptions& options);

/// Instant Radiosity with visibility by imperfect shadow maps.
///
/// In passes: a batch of lights (every n-th, so that a picture that was stopped shows all kinds), their maps, then all
/// tiles and samples; the picture is the mean of the passes. Returns how many samples a pixel there are in the film, which
/// is passes times camera samples. `statistics` receives shadow_maps and its time. Runs on the caller's TBB arena.
/// Throws Error{out_of_memory} before anything is allocated.
std::uint32_t light_by_maps(const MapLighting& lighting, Film& film, Progress& progress, const ProgressFn& callback,
                            TileCounts& counts, Statistics& statistics);

}  // namespace lightcuts
