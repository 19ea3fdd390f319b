// The stages of a frame at a number of lights, and which numbers.

#include <fmt/format.h>

#include "bench_frame/frame_bench.h"
#include "console.h"
#include "lightcuts/compare.h"

namespace lightcuts::app::frame {
namespace {

constexpr std::uint64_t kMostByAllMaps = 65536, kMostByAll = 262144;  ///< beyond, sums over all lights only grow evenly
constexpr std::uint64_t kMostByMaps = 1048576;                        ///< whose cut's maps the memory of a GPU holds

}  // namespace

void FrameBench::measure_stages(std::uint64_t vpls) {
  if (stopped() || !parts_.wants_lights(vpls)) return;
  use(vpls);
  time_vpls("vpls", kUnlimitedBounces);
  time_vpls("vpls, 4 bounces", 4);
  time_tree();
  if (parts_.wants_any_stage({"packet, none", "packet, rays", "packet, ism, maps too", "everything, ism"})) check_cut();
  shade("packet, none", options(Method::lightcuts, Visibility::none));
  shade("packet, rays", options(Method::lightcuts, Visibility::rays));
  const ShadeOptions by_maps = options(Method::lightcuts, Visibility::ism);
  shade("packet, ism", by_maps);
  shade("packet, ism, maps too", by_maps, Again::maps);
  shade("everything, ism", by_maps, Again::everything);
  if (vpls <= kMostByAllMaps) shade("all lights, none", options(Method::instant_radiosity, Visibility::none));
  if (vpls > 2550) return;
  shade("all lights, rays", options(Method::instant_radiosity, Visibility::rays));
  const ShadeOptions all_by_maps = options(Method::instant_radiosity, Visibility::ism);
  shade("all lights, ism", all_by_maps);
  shade("all lights, ism, maps too", all_by_maps, Again::maps);
}

void FrameBench::measure_heap(std::uint32_t batch) {
  ShadeOptions heap = options(Method::lightcuts, Visibility::none);
  heap.cut = CutWalk::heap;
  heap.max_cut = 1000;
  backend_->set_heap_batch(batch);
  shade(fmt::format("heap, none, {}", batch), heap);
}

/// Cuts and all lights, without visibility and by maps.
void FrameBench::measure_with_visibility(std::uint64_t vpls) {
  if (stopped() || !parts_.wants_lights(vpls)) return;
  use(vpls);
  if (vpls <= kMostByAll) shade("all lights, none", options(Method::instant_radiosity, Visibility::none));
  shade("packet, none", options(Method::lightcuts, Visibility::none));
  if (vpls <= kMostByAllMaps) shade("all lights, ism", options(Method::instant_radiosity, Visibility::ism));
  if (vpls <= kMostByMaps) shade("packet, ism", options(Method::lightcuts, Visibility::ism));
}

/// The study's numbers of lights, its way of cutting, and its limit on the cut.
void FrameBench::measure_as_the_study(std::uint64_t vpls) {
  if (stopped() || !parts_.wants_lights(vpls)) return;
  measure_with_visibility(vpls);
  measure_heap(4096);
  measure_heap(32768);
}

/// What packets, heaps and all lights cost, and the tree.
void FrameBench::measure_curve(std::uint64_t vpls) {
  if (stopped() || !parts_.wants_lights(vpls)) return;
  use(vpls);
  time_tree();
  measure_with_visibility(vpls);
  measure_heap(32768);
}

/// The cut's picture, small, against the sum over all lights; with maps, which let light through walls that cuts leave
/// out, against a cut of a twentieth of the error.
void FrameBench::check_cut() {
  constexpr int side = 64;
  make_lights();
  for (const Visibility visibility : {Visibility::none, Visibility::ism}) {
    if (stopped()) return;
    const auto picture = [&](const ShadeOptions& o) {
      Statistics s;
      return backend_->shade(camera_, side, side, o, 0, s, {}).image;
    };
    ShadeOptions exact = options(Method::instant_radiosity, visibility);
    if (visibility == Visibility::ism) {
      exact = options(Method::lightcuts, visibility);
      exact.error /= 20;
    }
    const Comparison c = compare(picture(options(Method::lightcuts, visibility)), picture(exact));
    const bool good = c.mean_relative_error < 0.02;
    result_.correct = result_.correct && good;
    print_result(fmt::format("{:<12} {:>8} {:<26} mean error {:.2f} %, 99th percentile {:.2f} %, signed {:.2f} %{}",
                             name_, vpls_, visibility == Visibility::ism ? "check of the cut, ism" : "check of the cut",
                             100 * c.mean_relative_error, 100 * c.p99_relative_error, 100 * c.signed_relative_error,
                             good ? "" : "  WRONG"));
  }
}

}  // namespace lightcuts::app::frame
