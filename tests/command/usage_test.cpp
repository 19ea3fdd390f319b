#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "command.h"

namespace lightcuts::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

TEST(Usage, HelpOfEveryCommandGoesToStdout) {
  for (const char* name : {"render", "compare", "info", "scenes", "export", "bench"}) {
    const ProgramResult r = run_lightcuts({name, "--help"});
    EXPECT_EQ(r.status, 0) << name;
    EXPECT_THAT(r.out, HasSubstr("Usage: lightcuts " + std::string(name)));
    EXPECT_THAT(r.err, IsEmpty());
  }
  EXPECT_THAT(run_lightcuts({"--help"}).out, HasSubstr("render --help"));
}

TEST(Usage, RangesAreCheckedBeforeTheSceneIsOpened) {
  const std::vector<std::vector<std::string>> bad{
      {"--ism-size", "48"}, {"--ism-size", "2048"},  {"--error", "0"},       {"--error", "1"},
      {"--error", "nan"},   {"--min-distance", "2"}, {"--ism-levels", "11"}, {"--vpls", "0"},
      {"--samples", "0"},   {"--deposit", "study"},  {"--size", "70000x10"}, {"--fov", "180"}};
  for (const std::vector<std::string>& words : bad) {
    std::vector<std::string> command{"render", "no-such-file.gltf"};
    command.insert(command.end(), words.begin(), words.end());
    const ProgramResult r = run_lightcuts(command);
    EXPECT_EQ(r.status, 2) << words[0] << ' ' << words[1] << ": " << r.err;
    EXPECT_THAT(r.err, Not(HasSubstr("no-such-file.gltf"))) << words[0];
  }
}

TEST(Usage, MoreLightsThanMemoryHoldsAreRefusedBeforeTheyAreMade) {
  const ProgramResult r = run_lightcuts(
      {"render", "builtin:cornell", "--size", "8x8", "--vpls", "100000000", "--memory", "1G", "-q", "-o", "never.exr"});
  EXPECT_EQ(r.status, 4) << r.err;
  EXPECT_THAT(r.err, HasSubstr("--vpls"));
  const ProgramResult film = run_lightcuts({"render", "builtin:cornell", "--size", "20000x20000", "--memory", "1G",
                                            "-q", "--method", "path", "-o", "never.exr"});
  EXPECT_EQ(film.status, 4) << film.err;
  EXPECT_THAT(film.err, HasSubstr("--size"));
}

TEST(Usage, RenderHelpNamesEveryOptionOfTheContract) {
  const std::string help = run_lightcuts({"render", "--help"}).out;
  for (const char* option : {"-o,--output",
                             "--layer",
                             "--method lightcuts|instant-radiosity|path",
                             "--visibility rays|ism|none",
                             "--backend auto|cpu|cuda",
                             "--device",
                             "--memory",
                             "--size",
                             "--camera",
                             "--eye",
                             "--target",
                             "--fov",
                             "--environment",
                             "--vpls N",
                             "--primary-lights",
                             "--vpls-per-light",
                             "--bounces B|inf",
                             "--vpl-placement power|camera",
                             "--deposit physical|study",
                             "--deposit-distance",
                             "--error",
                             "--max-cut",
                             "--tree agglomerative|ploc|morton",
                             "--metric walter|distance|distance-color|distance-direction|"
                             "distance-color-direction",
                             "--cut heap|packet",
                             "--ism-size",
                             "--ism-points",
                             "--min-distance",
                             "--samples",
                             "--exposure",
                             "--seed",
                             "--threads",
                             "--stats",
                             "--quiet",
                             "Too slow?",
                             "Too dark",
                             "(default: 10000)",
                             "(default: 0.02)",
                             "(default: 0.01)"}) {
    EXPECT_THAT(help, HasSubstr(option));
  }
}

TEST(Usage, NoLineOfHelpIsWiderThan110Columns) {
  for (const char* name : {"render", "compare", "info", "scenes", "export", "bench"}) {
    const std::string help = run_lightcuts({name, "--help"}).out;
    std::size_t column = 0;
    for (const char c : help) {
      column = c == '\n' ? 0 : column + 1;
      ASSERT_LE(column, 110u) << name << ": " << help;
    }
  }
}

TEST(Usage, VersionNamesCommitAndBackends) {
  const ProgramResult r = run_lightcuts({"--version"});
  EXPECT_EQ(r.status, 0);
  for (const char* part : {"lightcuts ", "commit ", "backends: cpu", "instruction sets"}) {
    EXPECT_THAT(r.out, HasSubstr(part));
  }
}

TEST(Usage, WithoutACommandHelpGoesToStderr) {
  const ProgramResult r = run_lightcuts({});
  EXPECT_EQ(r.status, 2);
  EXPECT_THAT(r.out, IsEmpty());
  EXPECT_THAT(r.err, HasSubstr("Start here"));
}

TEST(Usage, MisspeltWordsGetASuggestion) {
  const auto expect = [](std::vector<std::string> arguments, const std::string& suggestion) {
    const ProgramResult r = run_lightcuts(std::move(arguments));
    EXPECT_EQ(r.status, 2);
    EXPECT_THAT(r.err, HasSubstr("did you mean '" + suggestion + "'"));
  };
  expect({"rendr", "builtin:cornell"}, "render");
  expect({"render", "builtin:cornell", "--bonces", "3"}, "--bounces");
  expect({"render", "builtin:cornell", "--bonces=3"}, "--bounces");
  expect({"render", "--vpl", "3"}, "--vpls");
  expect({"render", "builtin:cornell", "--method", "pat"}, "path");
  expect({"render", "builtin:cornel"}, "cornell");
  expect({"compare", "a.exr", "b.exr", "--heat-map", "x.png"}, "--heatmap");
}

TEST(Usage, AFolderOrNothingIsNoScene) {
  const ProgramResult folder = run_lightcuts({"info", "/tmp"});
  EXPECT_EQ(folder.status, 3);
  EXPECT_THAT(folder.err, HasSubstr("folder"));
  const ProgramResult nothing = run_lightcuts({"info", ""});
  EXPECT_EQ(nothing.status, 3);
  EXPECT_THAT(nothing.err, HasSubstr("'': there is no such file"));
}

TEST(Usage, ACameraBeyondAllPlacesIsRefused) {
  for (const char* eye : {"1e30,2,5", "0,-1e13,0"}) {
    const ProgramResult r = run_lightcuts(
        {"render", "builtin:study", "--size", "8x8", "--eye", eye, "--target", "0,2,0", "-q", "-o", "never.exr"});
    EXPECT_EQ(r.status, 2) << eye << r.err;
    EXPECT_THAT(r.err, HasSubstr("1e+12 m")) << eye;
  }
}

TEST(Usage, MissingPrefixOfABuiltinSceneIsExplained) {
  const ProgramResult r = run_lightcuts({"info", "cornell"});
  EXPECT_EQ(r.status, 3);
  EXPECT_THAT(r.err, HasSubstr("builtin:cornell"));
}

TEST(Usage, ValuesOutOfRangeAreRefusedByName) {
  const std::vector<std::pair<std::string, std::string>> bad{
      {"--size", "0x10"},       {"--size", "10"},
      {"--size", "10x10x10"},   {"--vpls", "0"},
      {"--vpls", "many"},       {"--vpls", "-3"},
      {"--vpls", "1.5"},        {"--vpls", "99999999999999999999"},
      {"--samples", "0"},       {"--bounces", "-1"},
      {"--bounces", "nan"},     {"--error", "2"},
      {"--error", "nan"},       {"--min-distance", "-1"},
      {"--exposure", "bright"}, {"--memory", "4X"},
      {"--memory", "0"},        {"--memory", ""},
      {"--fov", "0"},           {"--fov", "180"},
      {"--environment", "-1"},  {"--environment", "1,2,-3"},
      {"--threads", "0"},       {"--ism-size", "0"},
      {"--method", ""},         {"--tree", "oak"},
      {"--seed", "x"},          {"--deposit-distance", "0"}};
  for (const auto& [option, value] : bad) {
    const ProgramResult r = run_lightcuts({"render", "builtin:cornell", option, value});
    EXPECT_EQ(r.status, 2) << option << " " << value << r.err;
    EXPECT_THAT(r.err, HasSubstr(option)) << value;
    EXPECT_THAT(r.out, IsEmpty());
  }
}

TEST(Usage, OptionsThatBelongTogether) {
  const std::vector<std::vector<std::string>> bad{{"--eye", "0,0,0"},
                                                  {"--target", "0,0,0"},
                                                  {"--eye", "1,1,1", "--target", "0,0,0", "--camera", "0"},
                                                  {"--eye", "1,1,1", "--target", "1,1,1"},
                                                  {"--eye", "1,1", "--target", "1,1,1"},
                                                  {"--primary-lights", "5"},
                                                  {"--vpls-per-light", "5"},
                                                  {"--vpls", "5", "--primary-lights", "5", "--vpls-per-light", "5"},
                                                  {"--deposit", "study"},
                                                  {"--deposit-distance", "1"},
                                                  {"--size", "8x8", "--size", "9x9"},
                                                  {"--camera", "no such camera"},
                                                  {"a second scene"}};
  for (std::vector<std::string> options : bad) {
    options.insert(options.begin(), {"render", "builtin:cornell"});
    const ProgramResult r = run_lightcuts(options);
    EXPECT_EQ(r.status, 2) << options[2] << r.err;
    EXPECT_THAT(r.err, Not(IsEmpty()));
  }
}

TEST(Usage, BenchListsItsBenchmarks) {
  EXPECT_EQ(run_lightcuts({"bench", "--list"}).status, 0);
  EXPECT_THAT(run_lightcuts({"bench", "--list"}).out, HasSubstr("study"));
  EXPECT_EQ(run_lightcuts({"bench", "stdy"}).status, 2);
}

}  // namespace
}  // namespace lightcuts::test
