#pragma once

#include <functional>

#include "cuda/light_maps.h"
#include "cuda/packet_cut.h"

namespace lightcuts::cuda {

/// Pixels whose heaps are in memory at once where nobody says otherwise: the larger of the study's two.
inline constexpr std::uint32_t kHeapBatch = 32768;

enum class HeapSight : std::uint8_t { all, rays, maps };

/// What decides on the light that arrives; `maps` and what follows for HeapSight::maps only.
struct HeapVisibility {
  HeapSight sight = HeapSight::all;
  MapSetView maps = {};
  WantedMaps wanted = {};
  ShareTable table = {};
  MissedList missed = {};  ///< receives pixels for which maps were missing, whose sums are as they were
};

/// Pixels by their slots; `slots` null: the first `count`.
struct PixelList {
  const std::uint32_t* slots = nullptr;
  std::uint32_t count = 0;
};

/// Lights pixels by the textbook cut, the study's way on a GPU: a thread a pixel with a heap of its own in global
/// memory, refined from the roots until its largest bound is small enough, a child sharing its parent's representative
/// wherever it can. Same decisions as the CPU's cut_by_heap.
///
/// @param batch  pixels at a time; fewer where their heaps would not fit into the device's limit
/// Without a largest cut, pixels whose heap turns out too small are lit again in smaller batches with larger heaps.
/// `go_on(done)` waits for the device and returns false to stop; returns false then.
/// Throws Error{out_of_memory} where not even a single warp's heaps fit.
bool cut_by_heaps(Device& device, const TracedScene& traced, const PixelView& pixels, const CutJob& job,
                  const HeapVisibility& visibility, PixelList list, std::uint32_t batch, const SumView& sums,
                  const CutView& cuts, const std::function<bool(double done)>& go_on);

}  // namespace lightcuts::cuda
