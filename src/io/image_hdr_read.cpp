#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include "io/image_formats.h"
#include "io/parse_float.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

[[noreturn]] void throw_malformed(const std::string& name, const std::string& what) {
  throw Error(Code::malformed, "'" + name + "' is not a readable Radiance picture: " + what);
}

/// How the scan lines lie in the picture: "-Y 480 +X 640" is row by row from the top left.
struct Layout {
  int line_count = 0, line_length = 0;
  bool lines_are_rows = true;
  bool lines_backwards = false;   ///< the first scan line is the bottom row or the right column
  bool pixels_backwards = false;  ///< within a scan line, from right to left or from bottom to top

  [[nodiscard]] int width() const { return lines_are_rows ? line_length : line_count; }
  [[nodiscard]] int height() const { return lines_are_rows ? line_count : line_length; }
  [[nodiscard]] std::size_t pixel(int line, int i) const {
    const int along = pixels_backwards ? line_length - 1 - i : i;
    const int across = lines_backwards ? line_count - 1 - line : line;
    const int row = lines_are_rows ? across : along, column = lines_are_rows ? along : across;
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width()) + static_cast<std::size_t>(column);
  }
};

struct Axis {
  bool is_y = false, increases = false;  ///< Y increases upwards
  int size = 0;
};

/// "+X 640" at the front of `text`, which moves behind it.
std::optional<Axis> take_axis(std::string_view& text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  if (text.size() < 4 || (text[0] != '+' && text[0] != '-') || (text[1] != 'X' && text[1] != 'Y') || text[2] != ' ')
    return {};
  Axis axis{text[1] == 'Y', text[0] == '+', 0};
  text.remove_prefix(3);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), axis.size);
  if (error != std::errc() || axis.size < 1) return {};
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return axis;
}

std::optional<Layout> parse_layout(std::string_view line) {
  const auto lines = take_axis(line);
  const auto pixels = take_axis(line);
  if (!lines || !pixels || lines->is_y == pixels->is_y || !line.empty()) return {};
  Layout layout;
  layout.line_count = lines->size;
  layout.line_length = pixels->size;
  layout.lines_are_rows = lines->is_y;
  // Our rows run downwards, so an increasing Y is backwards; X the other way round.
  const auto backwards = [](const Axis& axis) { return axis.is_y == axis.increases; };
  layout.lines_backwards = backwards(*lines);
  layout.pixels_backwards = backwards(*pixels);
  return layout;
}

using Rgbe = std::array<std::uint8_t, 4>;

class HdrReader {
 public:
  HdrReader(std::span<const std::byte> bytes, const std::string& name)
      : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), name_(name) {}

  Image read() {
    read_header();
    const std::optional<Layout> layout = parse_layout(take_line());
    if (!layout) throw_malformed(name_, "its line of sizes ('-Y height +X width') is missing or wrong");
    check_size(*layout);

    Image image = make_rgb_image(layout->width(), layout->height());
    std::vector<Rgbe> line(static_cast<std::size_t>(layout->line_length));
    for (int i = 0; i < layout->line_count; ++i) {
      read_scan_line(line);
      for (int j = 0; j < layout->line_length; ++j)
        store(line[static_cast<std::size_t>(j)], layout->pixel(i, j), image);
    }
    return image;
  }

 private:
  std::string_view take_line() {
    const std::size_t end = text_.find('\n');
    if (end == std::string_view::npos) throw_malformed(name_, "its header is cut short");
    std::string_view line = text_.substr(0, end);
    text_.remove_prefix(end + 1);
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }

  /// Lines up to an empty one. EXPOSURE lines multiply: the radiance is what the file says divided by all of them.
  void read_header() {
    take_line();  // "#?RADIANCE" or another program's name
    for (std::string_view line = take_line(); !line.empty(); line = take_line()) {
      if (line.starts_with("FORMAT=") && line.substr(7) != "32-bit_rle_rgbe") {
        throw Error(Code::unsupported, "'" + name_ + "' is a Radiance picture of the format '" +
                                           std::string(line.substr(7, 40)) + "'; convert it to 32-bit_rle_rgbe");
      }
      if (line.starts_with("EXPOSURE=")) {
        const std::optional<double> exposure = parse_number(line.substr(9));
        if (!exposure || !(*exposure > 0) || !std::isfinite(*exposure))
          throw_malformed(name_, "its EXPOSURE is not a positive number");
        scale_ /= *exposure;
      }
    }
  }

  void check_size(const Layout& layout) const {
    const double pixels = static_cast<double>(layout.line_count) * layout.line_length;
    // A run of at most 127 bytes takes 2, in each of four components; repeats of whole pixels give more.
    if (pixels > 65536 + 4096.0 * static_cast<double>(text_.size())) {
      throw_malformed(name_, "its header claims far more pixels than its bytes can hold");
    }
    if (pixels * sizeof(Vec3) > static_cast<double>(kImageBudget)) {
      throw Error(Code::unsupported, "'" + name_ + "' has " + std::to_string(layout.width()) + " x " +
                                         std::to_string(layout.height()) +
                                         " pixels, more than fit the limit of 1024 MiB for a picture; make it smaller");
    }
  }

  std::uint8_t take_byte() {
    if (text_.empty()) throw_malformed(name_, "the file ends within its pixels");
    const auto byte = static_cast<std::uint8_t>(text_.front());
    text_.remove_prefix(1);
    return byte;
  }
  Rgbe take_texel() {
    Rgbe texel;
    for (std::uint8_t& byte : texel) byte = take_byte();
    return texel;
  }

  void read_scan_line(std::vector<Rgbe>& line) {
    const bool may_have_runs = line.size() >= 8 && line.size() <= 0x7fff;
    const bool runs = may_have_runs && text_.size() >= 4 && text_[0] == 2 && text_[1] == 2 && (text_[2] & 0x80) == 0;
    if (!runs) {
      read_flat_line(line);
      return;
    }
    const Rgbe start = take_texel();
    if (static_cast<std::size_t>(start[2] << 8 | start[3]) != line.size()) {
      throw_malformed(name_, "a scan line has another length than its header says");
    }
    for (std::size_t component = 0; component < 4; ++component) read_component(line, component);
  }

  void read_component(std::vector<Rgbe>& line, std::size_t component) {
    for (std::size_t i = 0; i < line.size();) {
      const std::uint8_t code = take_byte();
      const std::size_t count = code > 128 ? code - 128u : code;
      if (count == 0 || count > line.size() - i) throw_malformed(name_, "a run of a scan line is empty or too long");
      const bool repeats = code > 128;
      const std::uint8_t repeated = repeats ? take_byte() : std::uint8_t{0};
      for (std::size_t end = i + count; i < end; ++i) line[i][component] = repeats ? repeated : take_byte();
    }
  }

  /// Pixel by pixel, or the old run lengths: mantissas (1, 1, 1) repeat the last pixel as often as the exponent says,
  /// several in a row being digits to the base 256.
  void read_flat_line(std::vector<Rgbe>& line) {
    int shift = 0;
    for (std::size_t i = 0; i < line.size();) {
      const Rgbe texel = take_texel();
      if (texel[0] != 1 || texel[1] != 1 || texel[2] != 1) {
        line[i++] = texel;
        shift = 0;
        continue;
      }
      const std::size_t count = shift > 24 ? line.size() : static_cast<std::size_t>(texel[3]) << shift;
      if (i == 0 || count > line.size() - i)
        throw_malformed(name_, "a repeat of a pixel has nothing to repeat or is too long");
      std::fill_n(line.begin() + static_cast<std::ptrdiff_t>(i), count, line[i - 1]);
      i += count;
      shift += 8;
    }
  }

  /// Without the half a step that Ward's first code adds: so black stays black, as in most readers.
  void store(const Rgbe& texel, std::size_t pixel, Image& image) const {
    if (texel[3] == 0) return;
    const double unit = std::ldexp(scale_, texel[3] - (128 + 8));
    for (std::size_t c = 0; c < 3; ++c) image.channels[c].values[pixel] = static_cast<float>(texel[c] * unit);
  }

  std::string_view text_;  ///< what is still to be read
  const std::string& name_;
  double scale_ = 1;
};

}  // namespace

Image read_hdr(std::span<const std::byte> bytes, const std::string& name) { return HdrReader(bytes, name).read(); }

}  // namespace lightcuts
