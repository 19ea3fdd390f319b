#pragma once

#include <cstdint>

#include "cuda/device.h"
#include "lightcuts/render.h"

namespace lightcuts::cuda {

/// Fills the empty texels of a square texture of 16-bit depth codes in a device's memory by pull and push, as fill_holes
/// does on the CPU: the study's way, its table 4.
///
/// The grid of threads is the same whatever the texture's size; each thread computes several means of a level, and each
/// level is a launch. `coarser` must hold atlas_scratch(size, levels) codes.
/// Source: the study's report, section 4.3.
void fill_atlas(Device& device, std::uint16_t* atlas, int size, int levels, HoleFill fill, std::uint16_t* coarser);

/// Codes of all coarser levels together.
std::uint64_t atlas_scratch(int size, int levels);

/// The same for HoleFill::mean and two levels, in one launch that reads the texture once and writes what it filled: a
/// thread pulls and pushes a square of 4 x 4 texels, which no other square touches.
void fill_atlas_at_once(Device& device, std::uint16_t* atlas, int size);

}  // namespace lightcuts::cuda
