#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bench_scene.h"

namespace lightcuts {

// What bench_ism measures. Each prints rows of a table; its heading is the function's own.

/// What agreement, lit surfaces and pictures are measured for.
struct Sweep {
  std::vector<int> texels;
  std::vector<std::uint32_t> points;
  std::size_t step = 20;  ///< every so many VPLs
};

/// Random pairs of a light and a place that face each other: what maps say against what rays say.
void print_agreement_heading();
void measure_agreement(const BenchScene& bench, const Sweep& sweep);
/// Places that a light reaches with no shadow's edge near: how much of it arrives.
void print_lit_heading();
void measure_lit(const BenchScene& bench, const Sweep& sweep);
/// Pictures by the sum over all lights against those of rays.
void print_pictures_heading();
void compare_pictures(const BenchScene& bench, const Sweep& sweep);

/// What a map costs in shadow rays, one thread.
void measure_speed(const BenchScene& bench);
/// What a map costs by texels, points and the number of maps, one thread.
void measure_scaling(const BenchScene& bench);

/// What lookups give by other rules than lookup_visibility's: of random pairs, of lit surfaces.
void print_rules_heading();
void compare_lookup_rules(const BenchScene& bench, int size);
/// relmse and FLIP of a picture by each rule against rays.
void print_rule_pictures_heading();
void compare_pictures_by_rules(const BenchScene& bench, int size);
/// How much light arrives close to where a box stands on a floor, by each rule.
void print_contact_heading();
void measure_contact_shadows(int size);

/// Points spent evenly against more of them where the light sees more: holes, agreement and pictures by the maps.
void print_adaptive_heading();
void compare_adaptive_points(const BenchScene& bench, std::uint32_t points);

/// Draws a VPL's map before and after pull-push, in false colour.
void draw_map_picture(const BenchScene& bench, std::uint32_t light, const std::string& path);

}  // namespace lightcuts
