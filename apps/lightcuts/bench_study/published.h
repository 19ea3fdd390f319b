#pragma once

#include <cstdint>
#include <span>

namespace lightcuts::app::study {

// What the study printed: Arbesser and Mühlbacher, "Lightcuts in CUDA mit Imperfect Shadow Maps", Vienna University of
// Technology, winter 2009/10.

struct PublishedTime {
  double x;  ///< VPLs, texels a side, or lights
  double seconds;
};
/// Table 1: VPLs made on a 3 GHz Core Duo.
std::span<const PublishedTime> published_table_1();
/// Table 4: pull-push in CUDA, texels a side.
std::span<const PublishedTime> published_table_4();

struct PublishedCuts {
  const char* metric;  ///< our name of it
  double cut_110, cut_930;
};
/// Tables 2 and 3: mean cut size.
std::span<const PublishedCuts> published_cuts();

struct PublishedFrame {
  std::uint64_t lights;
  double radiosity_4096, radiosity_32768, lightcuts_4096, lightcuts_32768;  ///< [s] by threads at a time
};
/// Table 5: 1000x1000 pixels in CUDA, imperfect shadow maps.
std::span<const PublishedFrame> published_frames();

struct PublishedSoftware {
  std::uint64_t lights;
  double radiosity, lightcuts;  ///< [s]
};
/// Table 6: 50x50 pixels in software.
std::span<const PublishedSoftware> published_software();

}  // namespace lightcuts::app::study
