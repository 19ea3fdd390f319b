#include "bench_study/sizes.h"

namespace lightcuts::app::study {

const Sizes& sizes_of(BenchScale scale) {
  static const Sizes smoke{.name = "smoke",
                           .repeats = 2,
                           .budget_s = 0.5,
                           .vpl_counts = {100, 1000},
                           .cut_side = 8,
                           .cut_lights = {10},
                           .cut_seeds = {2},
                           .atlas_maps = {11},
                           .frame_side = 16,
                           .frame_lights = {10, 20},
                           .software_lights = {20},
                           .software_sides = {16},
                           .all_published = false,
                           .picture_side = 16,
                           .picture_samples = 16,
                           .picture_vpls = 200,
                           .converge_side = 16,
                           .converge_samples = 32,
                           .converge_vpls = {100},
                           .converge_paths = {1, 4},
                           .stage_vpls = {1000},
                           .stage_side = 16};
  static const Sizes quick{.name = "quick",
                           .repeats = 3,
                           .budget_s = 2,
                           .vpl_counts = {100, 1000, 10000, 100000},
                           .cut_side = 24,
                           .cut_lights = {10, 30, 100},
                           .cut_seeds = {3, 3, 1},
                           .atlas_maps = {11, 21, 31},
                           .frame_side = 64,
                           .frame_lights = {10, 20, 30, 50, 100, 319},
                           .software_lights = {60, 80},
                           .software_sides = {50},
                           .all_published = false,
                           .picture_side = 64,
                           .picture_samples = 64,
                           .picture_vpls = 2000,
                           .converge_side = 32,
                           .converge_samples = 256,
                           .converge_vpls = {100, 1000, 10000},
                           .converge_paths = {1, 4, 16},
                           .stage_vpls = {1000, 10000, 100000},
                           .stage_side = 64};
  static const Sizes small{.name = "small",
                           .repeats = 5,
                           .budget_s = 12,
                           .vpl_counts = {100, 1000, 10000, 100000, 1000000},
                           .cut_side = 48,
                           .cut_lights = {10, 30, 100, 319},
                           .cut_seeds = {10, 10, 3, 3},
                           .atlas_maps = {11, 21, 31, 125},
                           .frame_side = 128,
                           .frame_lights = {10, 20, 30, 50, 100, 319, 1000},
                           .software_lights = {60, 80, 100, 120},
                           .software_sides = {50, 128},
                           .all_published = false,
                           .picture_side = 160,
                           .picture_samples = 256,
                           .picture_vpls = 10000,
                           .converge_side = 48,
                           .converge_samples = 512,
                           .converge_vpls = {100, 300, 1000, 3000, 10000, 30000, 100000},
                           .converge_paths = {1, 2, 4, 8, 16, 32, 64, 128},
                           .stage_vpls = {1000, 10000, 100000, 1000000},
                           .stage_side = 128};
  static const Sizes medium{.name = "medium",
                            .repeats = 5,
                            .budget_s = 14,
                            .vpl_counts = {100, 1000, 10000, 100000, 1000000},
                            .cut_side = 64,
                            .cut_lights = {10, 30, 100, 319},
                            .cut_seeds = {10, 10, 10, 3},
                            .atlas_maps = {11, 21, 31, 125},
                            .frame_side = 400,
                            .frame_lights = {10, 20, 30, 50, 100, 319, 1000},
                            .software_lights = {60, 80, 100, 120},
                            .software_sides = {50, 200, 1000},
                            .all_published = true,
                            .picture_side = 200,
                            .picture_samples = 256,
                            .picture_vpls = 10000,
                            .converge_side = 96,
                            .converge_samples = 512,
                            .converge_vpls = {100, 300, 1000, 3000, 10000, 30000, 100000},
                            .converge_paths = {1, 2, 4, 8, 16, 32, 64, 128},
                            .stage_vpls = {1000, 10000, 100000, 1000000},
                            .stage_side = 400};
  static const Sizes full{.name = "full",
                          .repeats = 5,
                          .budget_s = 300,
                          .vpl_counts = {100, 1000, 10000, 100000, 1000000},
                          .cut_side = 128,
                          .cut_lights = {10, 30, 100, 319},
                          .cut_seeds = {10, 10, 10, 3},
                          .atlas_maps = {11, 21, 31, 125},
                          .frame_side = 1000,
                          .frame_lights = {10, 20, 30, 50, 100, 319, 1000},
                          .software_lights = {60, 80, 100, 120},
                          .software_sides = {50, 200, 1000},
                          .all_published = true,
                          .picture_side = 256,
                          .picture_samples = 1024,
                          .picture_vpls = 100000,
                          .converge_side = 192,
                          .converge_samples = 512,
                          .converge_vpls = {100, 300, 1000, 3000, 10000, 30000, 100000, 1000000},
                          .converge_paths = {1, 2, 4, 8, 16, 32, 64, 128, 256},
                          .stage_vpls = {1000, 10000, 100000, 1000000},
                          .stage_side = 1000};
  switch (scale) {
    case BenchScale::smoke:
      return smoke;
    case BenchScale::quick:
      return quick;
    case BenchScale::small:
      return small;
    case BenchScale::medium:
      return medium;
    case BenchScale::full:
      return full;
  }
  return full;
}

}  // namespace lightcuts::app::study
