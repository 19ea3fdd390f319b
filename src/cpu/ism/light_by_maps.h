#pragma once

#include "cpu/ism/kept_maps.h"
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
  KeptMaps& kept;
  StageCounts& stages;  ///< receives points
};

/// Maps for cuts, planned before memory is taken. `statistics` receives the time of the points.
/// @param threads  of the TBB arena that will light tiles, which is the caller's
/// Throws Error{out_of_memory} before anything is allocated.
LightMaps& maps_for_cuts(const MapLighting& lighting, int threads, Statistics& statistics);

/// Instant Radiosity with visibility by imperfect shadow maps.
///
/// In passes: a batch of lights (every n-th, so that a picture that was stopped shows all kinds), their maps, then all
/// tiles and samples; the picture is the mean of the passes. Returns how many samples a pixel there are in the film, which
/// is passes times camera samples. Where they are few, maps are
/// kept for the next picture. `statistics` receives shadow_maps and its time. Runs on the caller's TBB arena.
/// Throws Error{out_of_memory} before anything is allocated.
std::uint32_t light_by_maps(const MapLighting& lighting, Film& film, Progress& progress, const ProgressFn& callback,
                            TileCounts& counts, Statistics& statistics);

}  // namespace lightcuts
