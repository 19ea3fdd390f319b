#include "lightcuts/text.h"

#include <gtest/gtest.h>

#include "lightcuts/error.h"
#include "lightcuts/progress_bar.h"
#include "lightcuts/render.h"
#include "lightcuts/values.h"

namespace lightcuts::app {
namespace {

TEST(Text, EditDistance) {
  EXPECT_EQ(edit_distance("", "abc"), 3u);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3u);
  EXPECT_EQ(edit_distance("cuont", "count"), 1u);  // neighbours swapped
  EXPECT_EQ(edit_distance("same", "same"), 0u);
}

TEST(Text, NearestNeedsToBeNear) {
  const std::vector<std::string> words{"--vpls", "--size", "--environment"};
  EXPECT_EQ(nearest("--vpl", words), "--vpls");
  EXPECT_EQ(nearest("--env", words), "--environment");
  EXPECT_EQ(nearest("--banana", words), "");
}

TEST(Text, Readable) {
  EXPECT_EQ(grouped(1234567), "1 234 567");
  EXPECT_EQ(grouped(12), "12");
  EXPECT_EQ(readable_bytes(1536), "1.5 KiB");
  EXPECT_EQ(readable_seconds(59), "59 s");
  EXPECT_EQ(readable_seconds(185), "3 min 05 s");
  EXPECT_EQ(readable_seconds(7800), "2 h 10 min");
}

TEST(Text, ShellQuoting) {
  EXPECT_EQ(shell_quoted("room.glb"), "room.glb");
  EXPECT_EQ(shell_quoted("builtin:lamps?count=3"), "'builtin:lamps?count=3'");
  EXPECT_EQ(shell_quoted("it's"), "'it'\\''s'");
  EXPECT_EQ(shell_quoted(""), "''");
}

TEST(Values, Bytes) {
  EXPECT_EQ(parse_bytes("512M"), 512ull << 20);
  EXPECT_EQ(parse_bytes("4G"), 4ull << 30);
  EXPECT_EQ(parse_bytes("4GiB"), 4ull << 30);
  EXPECT_EQ(parse_bytes("4gb"), 4'000'000'000ull);
  EXPECT_EQ(parse_bytes("1.5K"), 1536u);
  EXPECT_EQ(parse_bytes("123456"), 123456u);
  for (const char* bad : {"", "G", "4X", "4GG", "-4G", "0", "1e99G", "4 G"})
    EXPECT_THROW(parse_bytes(bad), Error) << bad;
}

TEST(Values, Counts) {
  EXPECT_EQ(parse_count("10000", 1, 20000), 10000u);
  EXPECT_EQ(parse_count("1e6", 1, 2000000), 1000000u);
  EXPECT_EQ(parse_count("18446744073709551615", 0, ~0ull), ~0ull);
  for (const char* bad : {"", "-1", "0", "1.5", "x", "1x", "20001"})
    EXPECT_THROW(parse_count(bad, 1, 20000), Error) << bad;
}

TEST(Values, Colours) {
  EXPECT_EQ(parse_colour("1,2,3")->y, 2);
  EXPECT_EQ(parse_colour("0.5")->z, 0.5f);
  EXPECT_NEAR(parse_colour("#ff8000")->y, 0.2158605f, 1e-6f);
  EXPECT_FALSE(parse_colour("sky.hdr").has_value());
  EXPECT_FALSE(parse_colour("#ff80").has_value());
  EXPECT_THROW(parse_colour("-1"), Error);
}

TEST(Values, Others) {
  EXPECT_EQ(parse_bounces("inf"), kUnlimitedBounces);
  EXPECT_EQ(parse_bounces("0"), 0);
  EXPECT_EQ(parse_size("640x480"), (std::pair{640, 480}));
  EXPECT_FALSE(parse_exposure("auto").has_value());
  EXPECT_EQ(parse_exposure("-1.5"), -1.5f);
}

TEST(TimeLeft, SteadyWorkAndAPauseLongAgo) {
  TimeLeft steady;
  for (int i = 0; i <= 10; ++i) steady.note(i, i * 0.05);
  EXPECT_NEAR(steady.seconds(), 10, 1e-9);

  // Nothing for the first 60 s, then 1 % a second: what counts is how fast it goes now.
  TimeLeft late;
  for (int i = 0; i <= 60; ++i) late.note(i, 0);
  for (int i = 1; i <= 70; ++i) late.note(60 + i, i * 0.01);
  EXPECT_NEAR(late.seconds(), 30, 1);
}

TEST(TimeLeft, SaysNothingTooEarly) {
  TimeLeft left;
  EXPECT_LT(left.seconds(), 0);
  left.note(0, 0);
  EXPECT_LT(left.seconds(), 0);
}

}  // namespace
}  // namespace lightcuts::app
