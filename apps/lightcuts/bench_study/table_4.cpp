// Table 4: pull-push over atlases of 128x128 maps: as one texture, level by level, as the study did; and fused, each
// map by itself, as the renderer does right after it has drawn one.

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <memory>

#include "bench_study/atlas.h"
#include "bench_study/cpu_maps.h"
#include "bench_study/published.h"
#include "bench_study/study.h"
#include "cpu/ism/fill_holes.h"

namespace lightcuts::app::study {
namespace {

constexpr std::size_t kMapSide = kStudyMapSide, kMapTexels = kMapSide * kMapSide;

/// Maps one behind the other.
Codes make_row(const std::vector<Codes>& maps, std::size_t count) {
  Codes row(count * kMapTexels);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    std::copy_n(maps[i % maps.size()].begin(), kMapTexels, row.begin() + static_cast<std::ptrdiff_t>(i * kMapTexels));
  });
  return row;
}

void fill_atlas(Codes& atlas, std::size_t side) {
  FillScratch<std::uint16_t> scratch;
  fill_holes(atlas.data(), static_cast<int>(side * kMapSide), kAtlasLevels, HoleFill::mean, scratch);
}

void fill_each(Codes& row, std::size_t count) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 8), [&](const tbb::blocked_range<std::size_t>& range) {
    FillScratch<std::uint16_t> scratch;
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      fill_holes(row.data() + i * kMapTexels, kMapSide, kAtlasLevels, HoleFill::mean, scratch);
    }
  });
}

/// Texels in which both ways differ. 128 is divisible by four, so with two levels no texel looks into its neighbour's
/// map.
std::size_t differing(const Codes& atlas, const Codes& row, std::size_t side) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < side * side; ++i) {
    const std::uint16_t* corner = atlas.data() + i / side * kMapSide * side * kMapSide + i % side * kMapSide;
    for (std::size_t t = 0; t < kMapTexels; ++t) {
      count += corner[t / kMapSide * side * kMapSide + t % kMapSide] != row[i * kMapTexels + t] ? 1 : 0;
    }
  }
  return count;
}

/// Times `fill` on fresh copies.
template <class Make, class Fill>
Json time_fill(const Sizes& sizes, double budget_s, const Make& make, const Fill& fill) {
  std::vector<Time> times;
  const Stopwatch all;
  do {
    Codes codes = make();
    const Stopwatch one;
    fill(codes);
    times.push_back(one.elapsed());
  } while (static_cast<int>(times.size()) < sizes.repeats && all.elapsed().wall_s < budget_s);
  return times_json(times);
}

/// Both ways on the processor.
Json measure_on_cpu(Study& study, const std::vector<Codes>& maps, std::size_t side) {
  Codes atlas = make_atlas(maps, side), row = make_row(maps, side * side);
  fill_atlas(atlas, side);
  fill_each(row, side * side);
  Json found{{"differing", differing(atlas, row, side)}};
  atlas = {};
  row = {};
  const double budget = study.request().budget_s;
  found["atlas"] = time_fill(
      study.sizes(), budget, [&] { return make_atlas(maps, side); }, [&](Codes& c) { fill_atlas(c, side); });
  study.stop_if_asked();
  found["fused"] = time_fill(
      study.sizes(), budget, [&] { return make_row(maps, side * side); }, [&](Codes& c) { fill_each(c, side * side); });
  return found;
}

/// Beyond the study's largest atlas, a GPU's run leaves the processor's times to the processor's own run.
Json measure_atlas(Study& study, const std::vector<Codes>& maps, std::size_t side) {
  Json found = Json::object();
  if (study.on_cpu() || side <= kStudyAtlas) found = measure_on_cpu(study, maps, side);
  study.stop_if_asked();
  if (!study.on_cpu()) {
    found["gpu"] = time_gpu_pull_push(study.request().device, maps, side, 4 * study.sizes().repeats);
  }
  return found;
}

}  // namespace

void make_table_4(Study& study) {
  Table table{
      "table-4",
      "Table 4. Pull-push of an atlas of 128x128 maps, two coarser levels: seconds",
      {"side", "way", "seconds", "low", "high", "cpu_seconds", "repeats", "million_texels_per_second", "source"},
      {}};
  const auto rate = [](double side, double seconds) { return 1e-6 * side * side / seconds; };
  for (const PublishedTime& p : published_table_4()) {
    table.add(
        {p.x, "one texture, CUDA", p.seconds, nullptr, nullptr, nullptr, nullptr, rate(p.x, p.seconds), kPublished});
  }
  std::vector<Codes> maps;
  std::vector<double> texels, seconds;
  study.until_stopped([&] {
    for (const int side : study.sizes().atlas_maps) {
      const Json found = study.measure(fmt::format("table-4/{}", side), [&] {
        if (maps.empty()) maps = maps_for_atlas();
        return measure_atlas(study, maps, static_cast<std::size_t>(side));
      });
      const int pixels = side * kStudyMapSide;
      const auto add = [&](const Json& t, const char* name) {
        table.add({pixels, name, t["wall_s"], t["low_s"], t["high_s"], t["cpu_s"], t["repeats"],
                   rate(pixels, t["wall_s"]), kMeasured});
      };
      if (found.contains("atlas")) {
        study.check(fmt::format("pull-push of {0}x{0} texels: fused against one texture", pixels),
                    found["differing"] == 0, fmt::format("{} texels differ", found["differing"].get<std::size_t>()));
        add(found["atlas"], "one texture, one thread");
        add(found["fused"], "fused, all threads");
      }
      if (found.contains("gpu")) {
        const Json& gpu = found["gpu"];
        study.check(fmt::format("pull-push of {0}x{0} texels: GPU against CPU", pixels), gpu["differing"] == 0,
                    fmt::format("{} texels differ", gpu["differing"].get<std::size_t>()));
        add(gpu["levels"], "one texture, CUDA");
        add(gpu["at_once"], "fused, CUDA");
      }
      texels.push_back(static_cast<double>(pixels) * pixels);
      seconds.push_back((found.contains("gpu") ? found["gpu"]["levels"] : found["fused"])["wall_s"]);
      study.show_done(static_cast<double>(texels.size()) / static_cast<double>(study.sizes().atlas_maps.size()));
    }
  });
  study.set("table_4_exponent", growth_exponent(texels, seconds));
  study.add(table);
}

}  // namespace lightcuts::app::study
