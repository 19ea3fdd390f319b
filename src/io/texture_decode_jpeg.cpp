// JPEG through libjpeg. Its errors leave by longjmp, so the functions that call it hold plain data only.

#include <fmt/format.h>

#include <csetjmp>
#include <cstdio>
// jpeglib.h needs FILE and size_t declared before it.
#include <jpeglib.h>

#include <algorithm>

#include "io/texture_decode_formats.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

/// A progressive file may ask for any number of passes over the picture; this many are far above what encoders write.
constexpr int kMaxScans = 100;

/// libjpeg's state and its last message.
struct JpegReader {
  jpeg_decompress_struct info{};
  jpeg_error_mgr errors{};
  jpeg_source_mgr source{};
  jpeg_progress_mgr progress{};
  std::jmp_buf escape{};
  char message[JMSG_LENGTH_MAX] = "";

  explicit JpegReader(std::span<const std::uint8_t> bytes);
  ~JpegReader() { jpeg_destroy_decompress(&info); }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;
};

[[noreturn]] void leave(j_common_ptr info, const char* why) {
  auto* reader = static_cast<JpegReader*>(info->client_data);
  std::snprintf(reader->message, sizeof reader->message, "%s", why);
  std::longjmp(reader->escape, 1);
}

void on_error(j_common_ptr info) {
  char text[JMSG_LENGTH_MAX];
  info->err->format_message(info, text);
  leave(info, text);
}

void on_message(j_common_ptr, int) {}  // warnings about padding and the like

boolean on_empty(j_decompress_ptr info) { leave(reinterpret_cast<j_common_ptr>(info), "the data ends too early"); }

void on_skip(j_decompress_ptr info, long count) {
  if (count <= 0) return;
  const auto bytes = static_cast<std::size_t>(count);
  if (bytes > info->src->bytes_in_buffer) on_empty(info);
  info->src->next_input_byte += bytes;
  info->src->bytes_in_buffer -= bytes;
}

void on_progress(j_common_ptr info) {
  auto* decompress = reinterpret_cast<j_decompress_ptr>(info);
  if (decompress->input_scan_number > kMaxScans) leave(info, "it asks for too many passes");
}

JpegReader::JpegReader(std::span<const std::uint8_t> bytes) {
  info.err = jpeg_std_error(&errors);
  info.client_data = this;
  errors.error_exit = on_error;
  errors.emit_message = on_message;
  source.next_input_byte = bytes.data();
  source.bytes_in_buffer = bytes.size();
  source.init_source = [](j_decompress_ptr) {};
  source.fill_input_buffer = on_empty;
  source.skip_input_data = on_skip;
  source.resync_to_restart = jpeg_resync_to_restart;
  source.term_source = [](j_decompress_ptr) {};
  progress.progress_monitor = on_progress;
}

/// Reads up to the pixels. False: see reader.message.
bool start(JpegReader& reader) {
  if (setjmp(reader.escape)) return false;
  jpeg_create_decompress(&reader.info);
  reader.info.src = &reader.source;
  reader.info.progress = &reader.progress;
  jpeg_read_header(&reader.info, TRUE);
  return true;
}

/// Settles the colour space and decodes. False: see reader.message.
bool begin_rows(JpegReader& reader) {
  if (setjmp(reader.escape)) return false;
  const J_COLOR_SPACE stored = reader.info.jpeg_color_space;
  reader.info.out_color_space = stored == JCS_GRAYSCALE                    ? JCS_GRAYSCALE
                                : stored == JCS_CMYK || stored == JCS_YCCK ? JCS_CMYK
                                                                           : JCS_RGB;
  jpeg_start_decompress(&reader.info);
  return true;
}

/// Reads one row. False: see reader.message.
bool read_row(JpegReader& reader, std::uint8_t* row) {
  if (setjmp(reader.escape)) return false;
  JSAMPROW rows[1] = {row};
  return jpeg_read_scanlines(&reader.info, rows, 1) == 1;
}

/// CMYK as Adobe's programs store it, inverted, or as the standard has it, to RGB.
void rgb_from_cmyk(const std::uint8_t* cmyk, std::uint8_t* rgb, std::size_t pixels, bool inverted) {
  for (std::size_t i = 0; i < pixels; ++i, cmyk += 4, rgb += 3) {
    for (std::size_t c = 0; c < 3; ++c) {
      const unsigned ink = inverted ? cmyk[c] : 255u - cmyk[c];
      const unsigned black = inverted ? cmyk[3] : 255u - cmyk[3];
      rgb[c] = static_cast<std::uint8_t>((ink * black + 127u) / 255u);
    }
  }
}

[[noreturn]] void fail(const std::string& name, const char* why) {
  throw Error(Code::malformed, fmt::format("{}: broken JPEG: {}. Export the picture again.", name, why));
}

}  // namespace

TextureHeader read_jpeg_header(std::span<const std::uint8_t> bytes, const std::string& name) {
  JpegReader reader(bytes);
  if (!start(reader)) fail(name, reader.message);
  const int components = reader.info.num_components;
  return {static_cast<int>(reader.info.image_width), static_cast<int>(reader.info.image_height),
          components == 1 ? 1 : 3};
}

TextureImage decode_jpeg(std::span<const std::uint8_t> bytes, const std::string& name) {
  JpegReader reader(bytes);
  if (!start(reader) || !begin_rows(reader)) fail(name, reader.message);
  const bool cmyk = reader.info.out_color_space == JCS_CMYK;
  const auto pixels = static_cast<std::size_t>(reader.info.output_width);
  TextureImage image;
  image.name = name;
  image.width = static_cast<int>(reader.info.output_width);
  image.height = static_cast<int>(reader.info.output_height);
  image.channels = cmyk ? 3 : reader.info.output_components;
  const std::size_t stride = pixels * static_cast<std::size_t>(image.channels);
  // Rows are added as they come: reserved memory that is never touched costs nothing, should the data end early.
  image.texels.reserve(stride * static_cast<std::size_t>(image.height));
  std::vector<std::uint8_t> cmyk_row(cmyk ? pixels * 4 : 0);
  for (int y = 0; y < image.height; ++y) {
    const std::size_t begin = image.texels.size();
    image.texels.resize(begin + stride);
    std::uint8_t* row = image.texels.data() + begin;
    if (!read_row(reader, cmyk ? cmyk_row.data() : row)) fail(name, reader.message);
    if (cmyk) rgb_from_cmyk(cmyk_row.data(), row, pixels, reader.info.saw_Adobe_marker != FALSE);
  }
  return image;
}

}  // namespace lightcuts
