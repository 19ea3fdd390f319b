#include "bench_frame/sizes.h"

namespace lightcuts::app::frame {

Sizes sizes_of(BenchScale scale) {
  switch (scale) {
    case BenchScale::smoke:
      return {32, 1, {200}, {110}, {300}, 300, 80, 10'000, 1};
    case BenchScale::quick:
      return {200, 3, {2550, 65536}, {110, 2550}, {}, 4096, 8192, 1'000'000, 2};
    case BenchScale::small:
      return {500, 5, {2550, 65536}, {110, 420, 930, 2550}, {16384}, 16384, 8192, 3'000'000, 5};
    case BenchScale::medium:
    case BenchScale::full:
      break;
  }
  return {1000,
          20,
          {2550, 65536, 1048576},
          {110, 420, 930, 2550},
          {16384, 65536, 262144, 1048576, 4194304},
          65536,
          8192,
          3'000'000,
          3};
}

}  // namespace lightcuts::app::frame
