#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/stat.h>

#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "command.h"
#include "lightcuts/io.h"

namespace lightcuts::test {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

std::string read_text(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

/// One triangle, no light, no camera.
constexpr const char* kTriangle = R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
  "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
  "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
  "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri":
  "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})";

class RenderCommand : public testing::Test {
 protected:
  std::vector<std::string> words(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "render");
    return lightcuts_words(std::move(arguments));
  }

  ProgramResult render(std::vector<std::string> arguments, ProgramOptions options = {}) const {
    if (options.folder.empty()) options.folder = folder_.path();
    return run_program(words(std::move(arguments)), options);
  }

  /// A small quick picture of the Cornell box.
  ProgramResult small(std::vector<std::string> arguments, const ProgramOptions& options = {}) const {
    arguments.insert(arguments.begin(), {"builtin:cornell", "--size", "24x16", "--vpls", "200"});
    return render(std::move(arguments), options);
  }

  TemporaryFolder folder_;
};

TEST_F(RenderCommand, DefaultOutputsStandInTheCurrentFolder) {
  const ProgramResult r = small({});
  ASSERT_EQ(r.status, 0) << r.err;
  EXPECT_THAT(folder_.names(), ElementsAre("cornell.exr", "cornell.png"));
  EXPECT_THAT(r.out, HasSubstr("wrote cornell.exr"));
  EXPECT_THAT(r.out, HasSubstr("wrote cornell.png"));
  EXPECT_THAT(r.out, HasSubstr("EV (auto)"));
  const Image image = load_image(folder_ / "cornell.exr");
  EXPECT_EQ(image.width, 24);
  EXPECT_EQ(image.height, 16);
  for (const char* layer : {"R", "G", "B", "albedo.R", "normal.X", "depth.Z"}) {
    EXPECT_NE(find_channel(image, layer), nullptr) << layer;
  }
  EXPECT_EQ(find_channel(image, "weight"), nullptr);
}

TEST_F(RenderCommand, EveryKindOfOutput) {
  const ProgramResult r = small({"-o", "a.exr", "-o", "b.png", "--output", "c.hdr", "--exposure", "1.5", "--quiet"});
  ASSERT_EQ(r.status, 0) << r.err;
  EXPECT_THAT(folder_.names(), ElementsAre("a.exr", "b.png", "c.hdr"));
  EXPECT_THAT(r.out, Not(HasSubstr("auto")));
  for (const std::string& name : folder_.names()) EXPECT_EQ(load_image(folder_ / name).width, 24) << name;
}

TEST_F(RenderCommand, LayerTurnsPngIntoFalseColour) {
  ASSERT_EQ(small({"-o", "picture.png"}).status, 0);
  const ProgramResult r = small({"-o", "depth.png", "-o", "depth.exr", "--layer", "depth"});
  ASSERT_EQ(r.status, 0) << r.err;
  EXPECT_THAT(r.out, HasSubstr("depth.Z from"));
  EXPECT_NE(read_text(folder_ / "depth.png"), read_text(folder_ / "picture.png"));
  EXPECT_NE(find_channel(load_image(folder_ / "depth.exr"), "R"), nullptr);
}

TEST_F(RenderCommand, LayersThatWillNotBeThereAreRefusedBefore) {
  for (const char* name : {"deepth", "cut.size", "albedo"}) {
    const ProgramResult r = small({"--layer", name, "--method", "instant-radiosity"});
    EXPECT_EQ(r.status, 2) << name;
    EXPECT_THAT(r.err, HasSubstr(name));
  }
  EXPECT_THAT(folder_.names(), IsEmpty());
}

TEST_F(RenderCommand, StatisticsHaveTheContractsSchema) {
  const ProgramResult r = small({"-o", "a.exr", "--stats", "a.json", "--bounces", "2"});
  ASSERT_EQ(r.status, 0) << r.err;
  const auto json = nlohmann::json::parse(read_text(folder_ / "a.json"));
  const std::map<std::string, std::vector<std::string>> schema{
      {"scene", {"triangles", "emitters", "lights"}},
      {"vpls", {"count", "primary", "paths"}},
      {"tree", {"nodes", "depth"}},
      {"cut", {"mean", "max", "at_limit", "lights_used"}},
      {"shadow_maps", {"count", "size", "bytes", "room", "rounds"}},
      {"time_ms", {"load", "bvh", "vpls", "tree", "shadow_maps", "shade", "write", "total"}},
      {"memory_bytes", {"host_peak", "device_peak"}}};
  for (const auto& [group, members] : schema) {
    for (const std::string& member : members) {
      EXPECT_TRUE(json.at(group).at(member).is_number()) << group << "." << member;
    }
  }
  for (const char* name : {"clamped", "rays", "pairs"}) EXPECT_TRUE(json.at(name).is_number()) << name;
  EXPECT_TRUE(json.at("version").is_string());
  EXPECT_FALSE(json.at("device").get<std::string>().empty());
  EXPECT_EQ(json.at("options").at("bounces"), 2);
  EXPECT_EQ(json.at("options").at("error"), 0.02);
  EXPECT_EQ(json.at("options").at("size"), nlohmann::json({24, 16}));
  EXPECT_GT(json.at("vpls").at("count").get<int>(), 100);
  EXPECT_GT(json.at("pairs").get<double>(), 24 * 16);
  EXPECT_GT(json.at("scene").at("triangles").get<int>(), 10);
  EXPECT_GT(json.at("memory_bytes").at("host_peak").get<double>(), 1e6);
  EXPECT_GE(json.at("time_ms").at("total").get<double>(), json.at("time_ms").at("shade").get<double>());
}

TEST_F(RenderCommand, ThreadsAndRunsDoNotChangeThePicture) {
  for (const char* method : {"lightcuts", "instant-radiosity", "path"}) {
    const std::vector<std::string> common{"--method", method, "--samples", "4", "-o"};
    std::vector<std::string> files;
    for (const char* threads : {"1", "2", "2"}) {
      const std::string name = std::string(method) + std::to_string(files.size()) + ".exr";
      std::vector<std::string> arguments = common;
      arguments.insert(arguments.end(), {name, "--threads", threads});
      ASSERT_EQ(small(arguments).status, 0);
      files.push_back(read_text(folder_ / name));
    }
    EXPECT_EQ(files[0], files[1]);
    EXPECT_EQ(files[1], files[2]);
  }
}

TEST_F(RenderCommand, AnotherSeedIsAnotherPicture) {
  ASSERT_EQ(small({"-o", "1.exr"}).status, 0);
  ASSERT_EQ(small({"-o", "2.exr", "--seed", "2"}).status, 0);
  EXPECT_NE(read_text(folder_ / "1.exr"), read_text(folder_ / "2.exr"));
}

TEST_F(RenderCommand, OwnCameraAndEnvironment) {
  for (const char* light : {"0.5", "0.2,0.4,0.8", "#8090ff"}) {
    const ProgramResult r =
        small({"-o", "a.exr", "--eye", "0.3,0.3,-0.5", "--target", "0.3,0.3,0", "--fov", "60", "--environment", light});
    EXPECT_EQ(r.status, 0) << r.err;
  }
  save_image(folder_ / "sky.hdr", make_rgb_image(8, 4));
  EXPECT_EQ(small({"-o", "a.exr", "--environment", "sky.hdr"}).status, 0);
  EXPECT_EQ(small({"-o", "a.exr", "--environment", "no-sky.hdr"}).status, 3);
}

TEST_F(RenderCommand, PlacesThatCannotBeWrittenAreRefusedBeforeTheWork) {
  std::ofstream(folder_ / "kept.exr") << "old";
  fs::permissions(folder_ / "kept.exr", fs::perms::owner_read);
  fs::create_directory(folder_ / "folder.exr");
  const std::vector<std::vector<std::string>> bad{{"-o", "no/such/folder/a.exr"},
                                                  {"-o", "kept.exr"},
                                                  {"-o", "folder.exr"},
                                                  {"-o", "a.bmp"},
                                                  {"-o", "a"},
                                                  {"-o", "a.json"},
                                                  {"-o", ""},
                                                  {"-o", "a.exr", "-o", "./a.exr"},
                                                  {"-o", "a.exr", "--stats", "no/such/folder/a.json"},
                                                  {"-o", "a.exr", "--stats", "a.txt"}};
  for (std::vector<std::string> arguments : bad) {
    // Path tracing at this size would take hours: a refusal that comes late runs into the time limit.
    arguments.insert(arguments.begin(), {"builtin:cornell", "--method", "path", "--samples", "100000"});
    ProgramOptions options;
    options.time_limit = std::chrono::seconds(20);
    EXPECT_EQ(render(arguments, options).status, 2) << arguments.back();
  }
  EXPECT_EQ(read_text(folder_ / "kept.exr"), "old");
  EXPECT_THAT(folder_.names(), ElementsAre("folder.exr", "kept.exr"));
}

TEST_F(RenderCommand, FullDiskIsFourAndLeavesNoPart) {
  std::ofstream(folder_ / "a.exr") << "old";
  ProgramOptions options;
  options.largest_file = 1024;
  const ProgramResult r = small({"-o", "a.exr", "-o", "b.hdr"}, options);
  EXPECT_EQ(r.status, 4) << r.err;
  EXPECT_THAT(r.err, HasSubstr("a.exr"));
  EXPECT_EQ(read_text(folder_ / "a.exr"), "old");
  EXPECT_THAT(folder_.names(), ElementsAre("a.exr"));
}

TEST_F(RenderCommand, FullStandardOutputIsReported) {
  const ProgramResult r = run_program({"/bin/sh", "-c", std::string(LC_COMMAND) + " scenes > /dev/full"});
  EXPECT_EQ(r.status, 4);
  EXPECT_THAT(r.err, HasSubstr("standard output"));
}

TEST_F(RenderCommand, SceneWithoutLightPrintsAReadyCommand) {
  std::ofstream(folder_ / "it's dark.gltf") << kTriangle;
  const ProgramResult r = render({"it's dark.gltf", "--size", "8x8", "--vpls", "50", "-o", "a.exr"});
  EXPECT_EQ(r.status, 3);
  const std::string arguments = " render 'it'\\''s dark.gltf' --size 8x8 --vpls 50 -o a.exr --environment 1";
  ASSERT_THAT(r.err, HasSubstr(LC_COMMAND + arguments));
  EXPECT_THAT(folder_.names(), ElementsAre("it's dark.gltf"));

  // The proposed command works as it stands.
  ProgramOptions options;
  options.folder = folder_.path();
  const ProgramResult again = run_program({"/bin/sh", "-c", LC_COMMAND + arguments}, options);
  EXPECT_EQ(again.status, 0) << again.err;
}

TEST_F(RenderCommand, WhatIsNotBuiltIsRefusedInASentence) {
  const ProgramResult r = small({"--visibility", "ism"});
  if (r.status == 0) return;  // built by now
  EXPECT_EQ(r.status, 2) << r.err;
  EXPECT_THAT(r.err, HasSubstr("not"));
}

TEST_F(RenderCommand, StatisticsOnStandardOutputStandAlone) {
  const ProgramResult r = small({"-o", "a.png", "--stats", "-", "--quiet"});
  ASSERT_EQ(r.status, 0) << r.err;
  EXPECT_EQ(nlohmann::json::parse(r.out).at("options").at("scene"), "builtin:cornell");
  EXPECT_THAT(r.err, HasSubstr("wrote a.png"));
  EXPECT_THAT(folder_.names(), ElementsAre("a.png"));
}

TEST_F(RenderCommand, TheStudysLayoutSaysWhyThereAreMoreVpls) {
  const ProgramResult r = render({"builtin:cornell", "--size", "8x8", "-q", "--primary-lights", "20",
                                  "--vpls-per-light", "5", "--bounces", "8", "-o", "a.exr"});
  ASSERT_EQ(r.status, 0) << r.err;
  EXPECT_THAT(r.err, HasSubstr("where 120 were asked for: each light shoots"));
}

TEST_F(RenderCommand, MissingDeviceOrBackend) {
  const ProgramResult r = small({"--backend", "cuda"});
  EXPECT_TRUE(r.status == 0 || r.status == 5) << r.err;
}

TEST_F(RenderCommand, NoProgressOutsideATerminal) {
  const ProgramResult r = small({});
  EXPECT_EQ(r.status, 0);
  EXPECT_THAT(r.err, Not(HasSubstr("\r")));
}

class LongRender : public RenderCommand {
 protected:
  /// Far more work than the test waits for.
  std::vector<std::string> long_words() const {
    return words({"builtin:cornell", "--method", "path", "--samples", "1000000", "--size", "64x64", "-o", "long.exr",
                  "--stats", "long.json"});
  }
};

/// What only shows on a terminal.
class OnTerminal : public LongRender {
 protected:
  void SetUp() override {
    if (!lends_terminals()) GTEST_SKIP() << "this system lends no terminal: /dev/pts is missing";
  }

  ProgramOptions on_terminal() const {
    ProgramOptions options;
    options.folder = folder_.path();
    options.terminal = true;
    options.environment["TERM"] = "xterm";
    return options;
  }
};

TEST_F(OnTerminal, SignalSavesWhatIsDone) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    Program program(long_words(), on_terminal());
    ASSERT_TRUE(program.wait_for_err("shade")) << program.err();
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    program.send(signal);
    program.send(signal);  // `timeout` sends it to the program and to its group: one wish, not two
    EXPECT_EQ(program.wait(), 130);
    const Image image = load_image(folder_ / "long.exr");
    EXPECT_EQ(image.attributes.at("complete"), "false");
    const Channel* weight = find_channel(image, "weight");
    ASSERT_NE(weight, nullptr);
    for (const float w : weight->values) ASSERT_TRUE(w >= 0 && w <= 1) << w;
    EXPECT_THAT(folder_.names(), ElementsAre("long.exr", "long.json"));
    EXPECT_THAT(program.err(), HasSubstr("will be saved"));
  }
}

TEST_F(OnTerminal, SecondSignalEndsAtOnceAndLeavesNoPart) {
  Program program(long_words(), on_terminal());
  ASSERT_TRUE(program.wait_for_err("shade")) << program.err();
  program.send(SIGINT);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  program.send(SIGTERM);
  EXPECT_EQ(program.wait(), 130);
  for (const std::string& name : folder_.names()) EXPECT_THAT(name, testing::StartsWith("long."));
}

TEST_F(OnTerminal, ASignalSentToAJobInTheBackgroundIsMeant) {
  ProgramOptions options = on_terminal();
  options.in_background = true;
  Program program(long_words(), options);
  ASSERT_TRUE(program.wait_for_err("shade")) << program.err();
  program.send(SIGINT);
  EXPECT_EQ(program.wait(), 130);
}

TEST_F(LongRender, SignalBeforeTheWorkEndsAtOnce) {
  // A pipe that nobody writes to: opening the scene waits.
  const fs::path pipe = folder_ / "scene.gltf";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  Program program(words({pipe.string(), "-o", (folder_ / "a.exr").string()}), {});
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  program.send(SIGTERM);
  const int status = program.wait();
  EXPECT_TRUE(status == 130 || status == 3) << status << program.err();
  EXPECT_THAT(folder_.names(), ElementsAre("scene.gltf"));
}

TEST_F(OnTerminal, QuietAndNoColorHold) {
  ProgramOptions options = on_terminal();
  options.environment["NO_COLOR"] = "1";
  Program plain(long_words(), options);
  ASSERT_TRUE(plain.wait_for_err("shade"));
  plain.send(SIGINT);
  EXPECT_EQ(plain.wait(), 130);
  EXPECT_THAT(plain.err(), Not(HasSubstr("\033[3")));

  const ProgramResult quiet = small({"--quiet"}, on_terminal());
  EXPECT_EQ(quiet.status, 0);
  EXPECT_THAT(quiet.err, IsEmpty());
}

}  // namespace
}  // namespace lightcuts::test
