#include <gtest/gtest.h>

#include <map>

#include "lightcuts/error.h"
#include "lightcuts/io.h"
#include "support/damage.h"
#include "support/shared_scenes.h"
#include "support/temporary_folder.h"

namespace lightcuts {
namespace {

namespace fs = std::filesystem;

enum class Outcome { loads, refused };

/// Loads a picture that may be damaged: anything but success or an Error with a code for bad input fails the test.
Outcome load(const fs::path& path) {
  SCOPED_TRACE(path);
  const test::ModestReading reading;
  Outcome outcome = Outcome::loads;
  try {
    const Image image = load_image(path);
    EXPECT_GT(image.pixel_count(), 0u);
    for (const Channel& channel : image.channels) EXPECT_EQ(channel.values.size(), image.pixel_count());
  } catch (const Error& e) {
    EXPECT_TRUE(e.code() == Code::malformed || e.code() == Code::unsupported) << e.what();
    EXPECT_NE(std::string(e.what()).find(path.filename().string()), std::string::npos) << e.what();
    outcome = Outcome::refused;
  }
  return outcome;
}

TEST(MalformedImages, DamagedOpenExrFilesLoadOrAreRefused) {
  LC_SKIP_WITHOUT_SHARED_SCENES();
  int count = 0;
  for (const auto& entry : fs::directory_iterator(test::shared_scenes() / "malformed/openexr-damaged")) {
    if (entry.path().extension() == ".md") continue;
    load(entry.path());
    ++count;
  }
  EXPECT_GE(count, 70);
}

TEST(MalformedImages, HostileFilesGetTheExpectedAnswer) {
  LC_SKIP_WITHOUT_SHARED_SCENES();
  int count = 0;
  for (const auto& [file, expected] : test::hostile_expectations()) {
    const std::string kind = file.substr(0, file.find('/'));
    if (kind != "exr" && kind != "hdr" && kind != "image") continue;
    SCOPED_TRACE(expected);
    ++count;
    const Outcome outcome = load(test::hostile_files() / file);
    if (expected.starts_with("LOADS:")) {
      EXPECT_EQ(outcome, Outcome::loads);
    } else if (expected.starts_with("REJECT") && !expected.starts_with("REJECT or")) {
      EXPECT_EQ(outcome, Outcome::refused);
    }
  }
  EXPECT_GE(count, 40);
}

TEST(MalformedImages, AppleVariantOfPngIsRefused) {
  LC_SKIP_WITHOUT_SHARED_SCENES();
  EXPECT_EQ(load(test::shared_scenes() / "image/magnum/rgba-binary-alpha-iphone.png"), Outcome::refused);
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
  const fs::path magnum = test::shared_scenes() / "image/magnum";
  for (const char* name : {"rgb.jpg", "rgb16f-tiled.exr", "rgb16f-ripmap.exr", "rgb-palette.png"}) {
    if (fs::exists(magnum / name)) files[name] = read_whole(magnum / name);
  }
  return files;
}

TEST(MutatedImages, FlippedAndCutFilesLoadOrAreRefused) {
  const TemporaryFolder folder;
  for (const auto& [name, good] : good_files(folder)) {
    test::Damage damage;
    int refused = 0;
    for (int i = 0; i < 100; ++i) {
      std::string mutant = good;
      if (i % 4 == 0) {
        mutant.resize(damage.below(good.size()));
      } else {
        // Headers decide on sizes: every other mutation aims at them.
        const std::size_t range = i % 2 == 0 ? good.size() : std::min<std::size_t>(good.size(), 300);
        damage.flip_bits(mutant, range);
        if (i % 8 == 1) mutant[damage.below(range)] = '\xff';
      }
      const fs::path path = folder / ("mutant-" + std::to_string(i) + "." + name.substr(name.rfind('.') + 1));
      write_whole(path, mutant);
      refused += load(path) == Outcome::refused ? 1 : 0;
    }
    EXPECT_GE(refused, 25) << name;  // at least the ones that were cut
  }
}

}  // namespace
}  // namespace lightcuts
