#include "bench_study/published.h"

namespace lightcuts::app::study {

std::span<const PublishedTime> published_table_1() {
  static constexpr PublishedTime all[] = {{100, 0.15}, {1000, 1.41}, {10000, 14.1}};
  return all;
}

std::span<const PublishedTime> published_table_4() {
  static constexpr PublishedTime all[] = {{1408, 0.011}, {2688, 0.033}, {3968, 0.08}};
  return all;
}

std::span<const PublishedCuts> published_cuts() {
  static constexpr PublishedCuts all[] = {{"distance", 68, 305},
                                          {"distance-color", 65, 265},
                                          {"distance-direction", 60, 250},
                                          {"distance-color-direction", 58, 220}};
  return all;
}

std::span<const PublishedFrame> published_frames() {
  static constexpr PublishedFrame all[] = {{110, 0.526, 0.189, 5.733, 6.182},
                                           {420, 1.471, 0.588, 31.392, 35.609},
                                           {930, 3.069, 1.208, 62.454, 67.241},
                                           {2550, 7.718, 3.137, 85.217, 87.003}};
  return all;
}

std::span<const PublishedSoftware> published_software() {
  static constexpr PublishedSoftware all[] = {
      {3660, 8.528, 11.613}, {6480, 15.715, 14.124}, {10100, 25.116, 17.956}, {14520, 36.589, 21.038}};
  return all;
}

}  // namespace lightcuts::app::study
