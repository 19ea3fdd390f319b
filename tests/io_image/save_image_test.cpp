#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>

#include "lightcuts/io.h"
#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace lightcuts {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// Files of this process may not grow beyond `bytes` while this lives: a full disk that needs no disk.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    old_handler_ = std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &old_);
    const rlimit limit{bytes, old_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &old_);
    std::signal(SIGXFSZ, old_handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit old_{};
  void (*old_handler_)(int) = nullptr;
};

/// Noise does not compress, so a limit on the file's size is surely reached.
Image noise_image(int width, int height) {
  Image image = make_rgb_image(width, height);
  std::uint32_t state = 1;
  for (Channel& channel : image.channels) {
    for (float& v : channel.values) v = static_cast<float>((state = state * 1664525u + 1013904223u) >> 8);
  }
  return image;
}

mode_t mode_of(const fs::path& path) {
  struct stat info {};
  stat(path.c_str(), &info);
  return info.st_mode & 07777;
}

TEST(SavePng, BytesComeBackAndThePictureIsMarkedAsSrgb) {
  const TemporaryFolder folder;
  DisplayImage image{3, 2, {0, 1, 2, 3, 4, 5, 6, 7, 8, 255, 254, 253, 9, 10, 11, 12, 13, 14}};
  save_png(folder / "a.png", image);
  EXPECT_THAT(read_whole(folder / "a.png"), HasSubstr("sRGB"));

  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_file(&png, (folder / "a.png").c_str()), 0);
  EXPECT_EQ(png.width, 3u);
  EXPECT_EQ(png.height, 2u);
  png.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> rgb(PNG_IMAGE_SIZE(png));
  ASSERT_NE(png_image_finish_read(&png, nullptr, rgb.data(), 0, nullptr), 0);
  EXPECT_EQ(rgb, image.rgb);
}

TEST(SavePng, RefusesWrongCounts) {
  const TemporaryFolder folder;
  expect_error(Code::invalid_argument, "three a pixel", [&] { save_png(folder / "a.png", {2, 2, {1, 2, 3}}); });
  expect_error(Code::invalid_argument, "0 x 2", [&] { save_png(folder / "a.png", {0, 2, {}}); });
  expect_error(Code::invalid_argument, ".png", [&] { save_png(folder / "a.jpg", {1, 1, {1, 2, 3}}); });
  EXPECT_EQ(folder.file_count(), 0u);
}

TEST(SaveImage, RefusesWhatItCannotWrite) {
  const TemporaryFolder folder;
  Image image = make_rgb_image(2, 2);
  expect_error(Code::invalid_argument, ".exr or .hdr", [&] { save_image(folder / "a.tiff", image); });
  image.channels[1].values.pop_back();
  expect_error(Code::invalid_argument, "'G' has 3 values", [&] { save_image(folder / "a.exr", image); });
  image.channels[1] = image.channels[0];
  expect_error(Code::invalid_argument, "two channels named 'R'", [&] { save_image(folder / "a.exr", image); });
  image = make_rgb_image(2, 2);
  image.attributes["compression"] = "none";
  expect_error(Code::invalid_argument, "'compression'", [&] { save_image(folder / "a.exr", image); });
  image = make_rgb_image(2, 2);
  image.channels[0].name = std::string(256, 'x');
  expect_error(Code::invalid_argument, "255", [&] { save_image(folder / "a.exr", image); });
  image.channels.clear();
  expect_error(Code::invalid_argument, "without channels", [&] { save_image(folder / "a.exr", image); });
  EXPECT_EQ(folder.file_count(), 0u);
}

TEST(AtomicWriting, FullDiskKeepsTheOldFileAndLeavesNothing) {
  const TemporaryFolder folder;
  const Image image = noise_image(200, 200);
  DisplayImage display{200, 200, {}};
  for (const Channel& channel : image.channels) {
    for (const float v : channel.values)
      display.rgb.push_back(static_cast<std::uint8_t>(static_cast<std::uint32_t>(v)));
  }
  for (const char* name : {"a.exr", "a.hdr", "a.png", "a.json"}) {
    write_whole(folder / name, "old");
    const FileSizeLimit limit(4096);
    expect_error(Code::disk_full, name, [&] {
      const std::string ending = fs::path(name).extension();
      if (ending == ".png") save_png(folder / name, display);
      if (ending == ".json") save_text(folder / name, std::string(10000, 'x'));
      if (ending == ".exr" || ending == ".hdr") save_image(folder / name, image);
    });
    EXPECT_EQ(read_whole(folder / name), "old") << name;
  }
  EXPECT_EQ(folder.file_count(), 4u);
}

// A picture's last bytes wait in buffers: their loss must be seen as well.
TEST(AtomicWriting, FullDiskIsSeenAtEveryLengthOfTheFile) {
  const TemporaryFolder folder;
  const Image image = noise_image(32, 32);
  save_image(folder / "whole.exr", image);
  const auto size = fs::file_size(folder / "whole.exr");
  for (rlim_t limit_bytes = 0; limit_bytes < size; limit_bytes += 97) {
    const FileSizeLimit limit(limit_bytes);
    expect_error(Code::disk_full, "a.exr", [&] { save_image(folder / "a.exr", image); });
  }
  const FileSizeLimit limit(size - 1);
  expect_error(Code::disk_full, "a.exr", [&] { save_image(folder / "a.exr", image); });
  EXPECT_EQ(folder.file_count(), 1u);
}

TEST(AtomicWriting, DevicesAreWrittenDirectly) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  const TemporaryFolder folder;
  fs::create_symlink("/dev/full", folder / "full.exr");
  expect_error(Code::disk_full, "full.exr", [&] { save_image(folder / "full.exr", noise_image(64, 64)); });
  expect_error(Code::disk_full, "/dev/full", [&] { save_text("/dev/full", "text"); });
  save_text("/dev/null", "text");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

TEST(AtomicWriting, KeepsPermissionsAndLinks) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "real");
  write_whole(folder / "real/target.json", "old");
  fs::permissions(folder / "real/target.json", fs::perms(0640));
  fs::create_symlink("real/target.json", folder / "link.json");
  save_text(folder / "link.json", "new");
  EXPECT_TRUE(fs::is_symlink(folder / "link.json"));
  EXPECT_EQ(read_whole(folder / "real/target.json"), "new");
  EXPECT_EQ(mode_of(folder / "real/target.json"), 0640u);

  fs::create_symlink("real/not-yet.json", folder / "dangling.json");
  save_text(folder / "dangling.json", "new");
  EXPECT_TRUE(fs::is_symlink(folder / "dangling.json"));
  EXPECT_EQ(read_whole(folder / "real/not-yet.json"), "new");

  fs::create_symlink("loop.json", folder / "loop.json");
  expect_error(Code::cannot_write, "loop.json", [&] { save_text(folder / "loop.json", "new"); });

  const mode_t old_mask = umask(027);
  save_text(folder / "masked.json", "new");
  umask(old_mask);
  EXPECT_EQ(mode_of(folder / "masked.json"), 0640u);
}

TEST(AtomicWriting, LongestNamesAndRelativePathsWork) {
  const TemporaryFolder folder;
  const std::string name = std::string(250, 'n') + ".json";
  save_text(folder / name, "text");
  EXPECT_EQ(read_whole(folder / name), "text");
  const fs::path old = fs::current_path();
  fs::current_path(folder.path());
  save_text("plain.json", "text");
  fs::current_path(old);
  EXPECT_EQ(read_whole(folder / "plain.json"), "text");
}

TEST(CheckWritable, SaysWhatIsWrong) {
  const TemporaryFolder folder;
  check_writable(folder / "new.exr");
  check_writable(folder / "NEW.PNG");
  EXPECT_EQ(folder.file_count(), 0u);

  expect_error(Code::cannot_write, "does not exist", [&] { check_writable(folder / "missing/a.exr"); });
  expect_error(Code::cannot_write, ".exr, .png, .hdr or .json", [&] { check_writable(folder / "a.tiff"); });
  expect_error(Code::cannot_write, ".exr, .png, .hdr or .json", [&] { check_writable(folder / "exr"); });
  fs::create_directory(folder / "folder.exr");
  expect_error(Code::cannot_write, "is a folder", [&] { check_writable(folder / "folder.exr"); });
  expect_error(Code::cannot_write, "folder", [&] { check_writable(folder.path().string() + "/"); });
  expect_error(Code::cannot_write, "folder", [&] { check_writable(""); });

  write_whole(folder / "old.exr", "old");
  check_writable(folder / "old.exr");
  expect_error(Code::cannot_write, "is a file, not a folder", [&] { check_writable(folder / "old.exr/a.exr"); });
  fs::permissions(folder / "old.exr", fs::perms(0444));
  expect_error(Code::cannot_write, "read-only", [&] { check_writable(folder / "old.exr"); });
  expect_error(Code::cannot_write, "read-only", [&] { save_image(folder / "old.exr", make_rgb_image(1, 1)); });
  EXPECT_EQ(read_whole(folder / "old.exr"), "old");
  fs::permissions(folder / "folder.exr", fs::perms(0555));
  expect_error(Code::cannot_write, "takes no new files", [&] { check_writable(folder / "folder.exr/a.exr"); });
}

}  // namespace
}  // namespace lightcuts
