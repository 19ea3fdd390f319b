#include <Iex.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <ImfPartType.h>
#include <ImfStringAttribute.h>
#include <ImfTileDescription.h>
#include <ImfVersion.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <new>

#include "io/image_formats.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

[[noreturn]] void throw_malformed(const std::string& name, const std::string& what) {
  throw Error(Code::malformed, "'" + name + "' is not a readable OpenEXR picture: " + what);
}

/// Lets OpenEXR read from memory; never past its end.
class ExrInput final : public Imf::IStream {
 public:
  ExrInput(std::span<const std::byte> bytes, const std::string& name) : Imf::IStream(name.c_str()), bytes_(bytes) {}
  bool read(char destination[], int count) override {
    if (count < 0 || offset_ > bytes_.size() || static_cast<std::size_t>(count) > bytes_.size() - offset_) {
      throw Iex::InputExc("the file ends too early");
    }
    if (count > 0) std::memcpy(destination, bytes_.data() + offset_, static_cast<std::size_t>(count));
    offset_ += static_cast<std::size_t>(count);
    return offset_ < bytes_.size();
  }
  std::uint64_t tellg() override { return offset_; }
  void seekg(std::uint64_t offset) override { offset_ = offset; }

 private:
  std::span<const std::byte> bytes_;
  std::uint64_t offset_ = 0;
};

/// Walks the attributes of all headers and checks that each fits the file.
///
/// OpenEXR allocates what an attribute's size field says before it reads: up to 2 GiB for a file of a few bytes.
class HeaderCheck {
 public:
  HeaderCheck(std::span<const std::byte> bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  void run() {
    offset_ = 4;  // after the magic number
    const std::uint32_t version = read_u32();
    if (!Imf::supportsFlags(Imf::getFlags(static_cast<int>(version))) ||
        Imf::getVersion(static_cast<int>(version)) != 2) {
      throw_malformed(name_, "its version or its flags are unknown");
    }
    const bool many_parts = Imf::isMultiPart(static_cast<int>(version));
    do {
      check_attributes();
    } while (many_parts && !at_empty_header());
  }

 private:
  void check_attributes() {
    while (skip_text() > 0) {
      skip_text();
      const std::uint32_t size = read_u32();
      if (size > bytes_.size() - offset_) throw_malformed(name_, "an attribute of its header is larger than the file");
      offset_ += size;
    }
  }
  bool at_empty_header() const { return offset_ >= bytes_.size() || bytes_[offset_] == std::byte{0}; }

  /// Length of the zero-terminated text at the offset, which moves behind it.
  std::size_t skip_text() {
    const auto rest = bytes_.subspan(offset_);
    const auto end = std::find(rest.begin(), rest.end(), std::byte{0});
    if (end == rest.end()) throw_malformed(name_, "its header is cut short");
    const auto length = static_cast<std::size_t>(end - rest.begin());
    offset_ += length + 1;
    return length;
  }
  std::uint32_t read_u32() {
    if (bytes_.size() - offset_ < 4) throw_malformed(name_, "its header is cut short");
    std::uint32_t value = 0;
    for (int i = 3; i >= 0; --i) value = value << 8 | std::to_integer<std::uint32_t>(bytes_[offset_ + i]);
    offset_ += 4;
    return value;
  }

  std::span<const std::byte> bytes_;
  const std::string& name_;
  std::size_t offset_ = 0;
};

struct Window {
  std::int64_t x = 0, y = 0, width = 0, height = 0;
  explicit Window(const Imath::Box2i& box)
      : x(box.min.x),
        y(box.min.y),
        width(std::int64_t{box.max.x} - box.min.x + 1),
        height(std::int64_t{box.max.y} - box.min.y + 1) {}
  [[nodiscard]] bool empty() const { return width < 1 || height < 1; }
  [[nodiscard]] double pixels() const { return static_cast<double>(width) * static_cast<double>(height); }
  bool operator==(const Window&) const = default;
};

double bytes_per_pixel(const Imf::Header& header) {
  double bytes = 0;
  for (auto c = header.channels().begin(); c != header.channels().end(); ++c) {
    bytes += c.channel().type == Imf::HALF ? 2 : 4;
  }
  return bytes;
}

std::size_t channel_count(const Imf::Header& header) {
  std::size_t count = 0;
  for (auto c = header.channels().begin(); c != header.channels().end(); ++c) ++count;
  return count;
}

/// Refuses, before anything is allocated for pixels, what is too large or too large for the file's bytes.
void check_sizes(const Imf::Header& header, std::size_t file_size, const std::string& name) {
  const Window data(header.dataWindow());
  const Window display(header.displayWindow());
  if (data.empty() || display.empty()) throw_malformed(name, "a window of it has no pixels");
  const auto channels = static_cast<double>(channel_count(header));
  if (channels == 0) throw_malformed(name, "it has no channels");

  const double planes = display.pixels() + (display == data ? 0 : data.pixels());
  double needed = sizeof(float) * channels * planes;
  if (header.hasTileDescription()) {
    const Imf::TileDescription& tiles = header.tileDescription();
    needed += bytes_per_pixel(header) * tiles.xSize * tiles.ySize;
  }
  if (needed > static_cast<double>(kImageBudget)) {
    throw Error(Code::unsupported, "'" + name + "' would take " +
                                       std::to_string(static_cast<std::uint64_t>(needed / (1 << 20))) +
                                       " MiB, more than the limit of 1024 MiB for a picture; make it smaller");
  }
  // No compression of the format reaches this ratio on a picture worth loading; damaged headers do.
  constexpr double kFreeBytes = 64.0 * (1 << 20), kMaxRatio = 2048;
  if (bytes_per_pixel(header) * data.pixels() > kFreeBytes + kMaxRatio * static_cast<double>(file_size)) {
    throw_malformed(name, "its header claims far more pixels than its bytes can hold");
  }
}

/// One channel's samples as the file has them: over the data window, perhaps subsampled.
struct Plane {
  int x_sampling = 1, y_sampling = 1;
  std::int64_t width = 0;
  std::vector<float> values;
};

Plane make_plane(const Imf::Channel& channel, const Window& data) {
  Plane plane;
  plane.x_sampling = std::max(channel.xSampling, 1);
  plane.y_sampling = std::max(channel.ySampling, 1);
  plane.width = (data.width + plane.x_sampling - 1) / plane.x_sampling;
  const std::int64_t height = (data.height + plane.y_sampling - 1) / plane.y_sampling;
  plane.values.resize(static_cast<std::size_t>(plane.width * height));
  return plane;
}

/// Copies the part of the data window that lies in the display window; the rest of `target` stays 0.
void place(const Plane& plane, const Window& data, const Window& display, std::vector<float>& target) {
  const std::int64_t x_begin = std::max(data.x, display.x),
                     x_end = std::min(data.x + data.width, display.x + display.width);
  const std::int64_t y_begin = std::max(data.y, display.y),
                     y_end = std::min(data.y + data.height, display.y + display.height);
  for (std::int64_t y = y_begin; y < y_end; ++y) {
    const std::int64_t source_row = (y - data.y) / plane.y_sampling * plane.width;
    const std::int64_t target_row = (y - display.y) * display.width - display.x;
    for (std::int64_t x = x_begin; x < x_end; ++x) {
      target[static_cast<std::size_t>(target_row + x)] =
          plane.values[static_cast<std::size_t>(source_row + (x - data.x) / plane.x_sampling)];
    }
  }
}

Image read_first_part(Imf::MultiPartInputFile& file) {
  const Imf::Header& header = file.header(0);
  const Window data(header.dataWindow());
  const Window display(header.displayWindow());

  std::vector<Plane> planes;
  for (auto c = header.channels().begin(); c != header.channels().end(); ++c) {
    planes.push_back(make_plane(c.channel(), data));
  }
  Imf::FrameBuffer buffer;
  auto plane = planes.begin();
  for (auto c = header.channels().begin(); c != header.channels().end(); ++c, ++plane) {
    buffer.insert(c.name(), Imf::Slice::Make(Imf::FLOAT, plane->values.data(), header.dataWindow(), sizeof(float),
                                             sizeof(float) * static_cast<std::size_t>(plane->width), plane->x_sampling,
                                             plane->y_sampling));
  }
  Imf::InputPart part(file, 0);
  part.setFrameBuffer(buffer);
  part.readPixels(header.dataWindow().min.y, header.dataWindow().max.y);

  Image image;
  image.width = static_cast<int>(display.width);
  image.height = static_cast<int>(display.height);
  plane = planes.begin();
  for (auto c = header.channels().begin(); c != header.channels().end(); ++c, ++plane) {
    Channel& channel = image.channels.emplace_back(Channel{c.name(), {}});
    if (data == display && plane->x_sampling == 1 && plane->y_sampling == 1) {
      channel.values = std::move(plane->values);
    } else {
      channel.values.assign(image.pixel_count(), 0.0f);
      place(*plane, data, display, channel.values);
      plane->values = {};
    }
  }
  return image;
}

void read_attributes(const Imf::Header& header, Image& image) {
  for (auto a = header.begin(); a != header.end(); ++a) {
    const auto* text = dynamic_cast<const Imf::StringAttribute*>(&a.attribute());
    if (text != nullptr && !is_exr_format_attribute(a.name())) image.attributes[a.name()] = text->value();
  }
}

/// Luminance and two chromas (OpenEXR's "Y RY BY") as R, G and B; the three stay.
/// Source: OpenEXR technical introduction, "Luminance/Chroma Images"; weights of Rec. 709.
void add_rgb_of_luminance_chroma(Image& image) {
  const auto has = [&](const char* name) { return find_channel(image, name) != nullptr; };
  if (!has("Y") || !has("RY") || !has("BY") || has("R") || has("G") || has("B")) return;
  for (const char* name : {"R", "G", "B"}) ensure_channel(image, name);
  const auto values = [&](const char* name) { return find_channel(image, name)->values.data(); };
  const float *y = values("Y"), *ry = values("RY"), *by = values("BY");
  float *r = values("R"), *g = values("G"), *b = values("B");
  for (std::size_t i = 0; i < image.pixel_count(); ++i) {
    r[i] = (ry[i] + 1) * y[i];
    b[i] = (by[i] + 1) * y[i];
    g[i] = (y[i] - 0.2126f * r[i] - 0.0722f * b[i]) / 0.7152f;
  }
}

}  // namespace

Image read_exr(std::span<const std::byte> bytes, const std::string& name) {
  HeaderCheck(bytes, name).run();
  try {
    ExrInput input(bytes, name);
    // Offsets of chunks that a broken writer left out are not searched for: a whole file has them.
    Imf::MultiPartInputFile file(input, 0, false);
    const Imf::Header& header = file.header(0);
    if (header.hasType() && Imf::isDeepData(header.type())) {
      throw Error(Code::unsupported,
                  "'" + name + "' holds deep data (many samples a pixel): flatten it to a plain picture first");
    }
    check_sizes(header, bytes.size(), name);
    Image image = read_first_part(file);
    read_attributes(header, image);
    add_rgb_of_luminance_chroma(image);
    return image;
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw Error(Code::out_of_memory, "there is not enough memory to read the picture '" + name + "'");
  } catch (const std::exception& e) {
    throw_malformed(name, e.what());
  }
}

}  // namespace lightcuts
