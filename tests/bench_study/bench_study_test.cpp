#include <gmock/gmock.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "bench.h"
#include "bench_study/ledger.h"
#include "bench_study/measure.h"
#include "bench_study/references.h"
#include "bench_study/series.h"
#include "bench_study/table.h"

namespace lightcuts::app::study {
namespace {

Series series_of(std::initializer_list<std::pair<double, double>> points) {
  Series series;
  for (const auto& [x, y] : points) series.add(x, y);
  return series;
}

TEST(Series, ExpectsAtMostLinearGrowth) {
  EXPECT_EQ(series_of({}).expected(100), 0);
  EXPECT_DOUBLE_EQ(series_of({{100, 2}}).expected(400), 8);
  EXPECT_NEAR(series_of({{100, 1}, {400, 2}}).expected(1600), 4, 1e-12);   // as the square root
  EXPECT_NEAR(series_of({{100, 1}, {200, 16}}).expected(400), 32, 1e-12);  // never steeper than the lights
  EXPECT_NEAR(series_of({{100, 2}, {200, 1}}).expected(400), 1, 1e-12);    // nor falling
}

TEST(Series, CrossesWhereBothTakeAsLong) {
  const Series slow = series_of({{100, 1}, {1000, 10}, {10000, 100}});
  EXPECT_NEAR(*crossing(slow, series_of({{100, 10}, {1000, 10}, {10000, 10}})), 1000, 1e-6);
  EXPECT_NEAR(*crossing(slow, series_of({{100, 10 / std::sqrt(10.0)}, {1000, 10 / std::sqrt(10.0)}, {10000, 3}})),
              100 * std::sqrt(10.0), 1e-6);
  EXPECT_EQ(*crossing(slow, series_of({{100, 0.5}, {1000, 5}, {10000, 5}})), 100);
  EXPECT_FALSE(crossing(slow, series_of({{100, 2}, {1000, 20}, {10000, 200}})).has_value());
  EXPECT_FALSE(crossing(slow, series_of({{100, 0.5}, {1000, 5}, {10000, 200}})).has_value());
  EXPECT_GT(*crossing(slow, series_of({{100, 0.5}, {1000, 20}, {10000, 50}})), 1000);
}

TEST(Measure, FindsThePowerOfGrowth) {
  EXPECT_NEAR(growth_exponent({1, 10, 100}, {3, 30, 300}), 1, 1e-12);
  EXPECT_NEAR(growth_exponent({1, 4, 16}, {1, 2, 4}), 0.5, 1e-12);
  EXPECT_EQ(growth_exponent({1}, {1}), 0);
  const Spread spread = spread_of({1, 2, 3, 4});
  EXPECT_DOUBLE_EQ(spread.mean, 2.5);
  EXPECT_NEAR(spread.deviation, std::sqrt(5.0 / 3), 1e-12);
  const Repeats repeats = summarise({3, 1, 2, 10});
  EXPECT_DOUBLE_EQ(repeats.median, 2.5);
  EXPECT_EQ(repeats.low, 1);
  EXPECT_EQ(repeats.high, 10);
}

TEST(Measure, RepeatsUntilTheTimeIsUp) {
  int count = 0;
  EXPECT_EQ(time_repeatedly(4, 10, [&] { ++count; })["repeats"], 4);
  EXPECT_EQ(count, 4);
  EXPECT_EQ(time_repeatedly(4, 0, [&] { ++count; })["repeats"], 1);
}

TEST(Table, WritesCsvThatQuotes) {
  Table table{"t", "Title", {"a", "b"}, {}};
  table.add({1, "x,y"});
  table.add({nullptr, "say \"so\""});
  table.add({0.25, kPublished});
  EXPECT_EQ(table_csv(table), "a,b\r\n1,\"x,y\"\r\n,\"say \"\"so\"\"\"\r\n0.25,published\r\n");
  EXPECT_THAT(table_text(table), testing::HasSubstr("published"));
  EXPECT_EQ(table_json(table)["rows"][2][1], "published");
}

TEST(Ledger, KeepsResultsOfTheSameRunOnly) {
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / ("lightcuts-ledger-" + std::to_string(getpid()) + ".json");
  std::filesystem::remove(file);
  {
    Ledger ledger(file, {{"commit", "a"}});
    EXPECT_EQ(ledger.find("one"), nullptr);
    ledger.keep("one", {{"seconds", 1.5}});
  }
  {
    const Ledger again(file, {{"commit", "a"}});
    ASSERT_NE(again.find("one"), nullptr);
    EXPECT_EQ((*again.find("one"))["seconds"], 1.5);
    EXPECT_EQ(Ledger(file, {{"commit", "b"}}).find("one"), nullptr);
  }
  std::ofstream(file) << "{\"identity\": damaged";
  EXPECT_EQ(Ledger(file, {{"commit", "a"}}).find("one"), nullptr);
  std::filesystem::remove(file);
}

TEST(References, TheirNoiseIsNotCounted) {
  constexpr int side = 200;
  std::mt19937 random(1);
  std::normal_distribution<float> noise(0, 0.2f);
  Image image = make_rgb_image(side, side);
  Halves halves{make_rgb_image(side, side), make_rgb_image(side, side)};
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < image.pixel_count(); ++i) {
      image.channels[c].values[i] = 1.1f;  // truth: 1
      halves.first.channels[c].values[i] = 1 + noise(random);
      halves.second.channels[c].values[i] = 1 + noise(random);
    }
  }
  // 0.1^2 / 1.01, though each half alone is off by 0.2^2 and more.
  const Estimate found = relmse_without_noise(image, halves);
  EXPECT_NEAR(found.value, 0.01, 0.0015);
  EXPECT_LT(std::abs(found.value - 0.01), 4 * found.standard_error);
  EXPECT_LT(found.standard_error, 0.0015);
}

}  // namespace
}  // namespace lightcuts::app::study
