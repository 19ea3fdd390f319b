#include <gtest/gtest.h>
#include <sys/resource.h>

#include <ctime>
#include <fstream>
#include <map>
#include <sstream>

#include "io_image/errors.h"
#include "io_image/temporary_folder.h"
#include "lightcuts/io.h"

namespace lightcuts {
namespace {

namespace fs = std::filesystem;

enum class Outcome { loads, refused };

/// Loads a picture that may be damaged: anything but success or an Error with a code for bad input fails the test.
Outcome load(const fs::path& path) {
  SCOPED_TRACE(path);
  const std::clock_t start = std::clock();  // processor time: other programs do not count
  Outcome outcome = Outcome::loads;
  try {
    const Image image = load_image(path);
    EXPECT_GT(image.pixel_count(), 0u);
    for (const Channel& channel : image.channels) EXPECT_EQ(channel.values.size(), image.pixel_count());
  } catch (const Error& e) {
    EXPECT_TRUE(e.code() == Code::malformed || e.code() == Code::unsupported || e.code() == Code::out_of_memory)
        << e.what();
    EXPECT_NE(std::string(e.what()).find(path.filename().string()), std::string::npos) << e.what();
    outcome = Outcome::refused;
  }
  EXPECT_LT(std::clock() - start, 10 * CLOCKS_PER_SEC);
  return outcome;
}

/// Most memory this process ever held [bytes].
std::uint64_t peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

#define SKIP_WITHOUT_SHARED_SCENES() \
  if (!fs::exists(LC_SHARED_SCENES)) GTEST_SKIP() << "the shared scenes are not beside this checkout"

TEST(MalformedImages, DamagedOpenExrFilesLoadOrAreRefused) {
  SKIP_WITHOUT_SHARED_SCENES();
  int count = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(LC_SHARED_SCENES) / "malformed/openexr-damaged")) {
    if (entry.path().extension() == ".md") continue;
    load(entry.path());
    ++count;
  }
  EXPECT_GE(count, 70);
  EXPECT_LT(peak_memory(), std::uint64_t{1} << 30);
}

TEST(MalformedImages, HostileFilesGetTheExpectedAnswer) {
  SKIP_WITHOUT_SHARED_SCENES();
  const fs::path folder = fs::path(LC_SHARED_SCENES) / "malformed/own-hostile";
  std::ifstream list(folder / "EXPECTED.tsv");
  int count = 0;
  for (std::string line; std::getline(list, line);) {
    std::istringstream fields(line);
    std::string file, bytes, expected;
    std::getline(fields, file, '\t');
    std::getline(fields, bytes, '\t');
    std::getline(fields, expected, '\t');
    const std::string kind = file.substr(0, file.find('/'));
    if (kind != "exr" && kind != "hdr" && kind != "image") continue;
    SCOPED_TRACE(line);
    ++count;
    const Outcome outcome = load(folder / file);
    if (expected.starts_with("LOADS:")) {
      EXPECT_EQ(outcome, Outcome::loads);
    } else if (expected.starts_with("REJECT") && !expected.starts_with("REJECT or")) {
      EXPECT_EQ(outcome, Outcome::refused);
    }
  }
  EXPECT_GE(count, 40);
  EXPECT_LT(peak_memory(), std::uint64_t{1} << 30);
}

TEST(MalformedImages, AppleVariantOfPngIsRefused) {
  SKIP_WITHOUT_SHARED_SCENES();
  EXPECT_EQ(load(fs::path(LC_SHARED_SCENES) / "image/magnum/rgba-binary-alpha-iphone.png"), Outcome::refused);
}

/// A good file of each kind, the smaller the more of it a mutation hits.
std::map<std::string, std::string> good_files(const TemporaryFolder& folder) {
  Image image = make_rgb_image(20, 9);
  for (Channel& channel : image.channels) {
    for (std::size_t i = 0; i < channel.values.size(); ++i) channel.values[i] = static_cast<float>(i % 7) * 0.3f;
  }
  save_image(folder / "good.exr", image);
  save_image(folder / "good.hdr", image);
  save_png(folder / "good.png", {4, 2, std::vector<std::uint8_t>(24, 200)});
  std::map<std::string, std::string> files;
  for (const char* ending : {"exr", "hdr", "png"}) files[ending] = read_whole(folder / (std::string("good.") + ending));
  const fs::path magnum = fs::path(LC_SHARED_SCENES) / "image/magnum";
  for (const char* name : {"rgb.jpg", "rgb16f-tiled.exr", "rgb16f-ripmap.exr", "rgb-palette.png"}) {
    if (fs::exists(magnum / name)) files[name] = read_whole(magnum / name);
  }
  return files;
}

TEST(MutatedImages, FlippedAndCutFilesLoadOrAreRefused) {
  const TemporaryFolder folder;
  for (const auto& [name, good] : good_files(folder)) {
    std::uint32_t state = 1;
    const auto random = [&](std::size_t below) {
      state = state * 1664525u + 1013904223u;
      return static_cast<std::size_t>(state >> 8) % below;
    };
    int refused = 0;
    for (int i = 0; i < 100; ++i) {
      std::string mutant = good;
      if (i % 4 == 0) {
        mutant.resize(random(good.size()));
      } else {
        // Headers decide on sizes: every other mutation aims at them.
        const std::size_t range = i % 2 == 0 ? good.size() : std::min<std::size_t>(good.size(), 300);
        for (std::size_t flips = 1 + random(4); flips > 0; --flips)
          mutant[random(range)] ^= static_cast<char>(1 << random(8));
        if (i % 8 == 1) mutant[random(range)] = '\xff';
      }
      const fs::path path = folder / ("mutant-" + std::to_string(i) + "." + name.substr(name.rfind('.') + 1));
      write_whole(path, mutant);
      refused += load(path) == Outcome::refused ? 1 : 0;
    }
    EXPECT_GE(refused, 25) << name;  // at least the ones that were cut
  }
  EXPECT_LT(peak_memory(), std::uint64_t{1} << 30);
}

}  // namespace
}  // namespace lightcuts
