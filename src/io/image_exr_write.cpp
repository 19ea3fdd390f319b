#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>

#include <exception>
#include <set>

#include "io/image_formats.h"
#include "lightcuts/error.h"

namespace lightcuts {
namespace {

/// Lets OpenEXR write through an AtomicFile, so that a full disk is seen as such.
class ExrOutput final : public Imf::OStream {
 public:
  explicit ExrOutput(AtomicFile& file) : Imf::OStream("picture"), file_(file) {}
  void write(const char bytes[], int count) override {
    file_.write(std::as_bytes(std::span(bytes, static_cast<std::size_t>(count))));
  }
  std::uint64_t tellp() override { return file_.tell(); }
  void seekp(std::uint64_t offset) override { file_.seek(offset); }

 private:
  AtomicFile& file_;
};

// The format's limit on names, its terminating zero left out.
constexpr std::size_t kMaxNameLength = 255;

void require_name(const std::string& name, const char* what) {
  if (name.empty() || name.size() > kMaxNameLength || name.find('\0') != std::string::npos) {
    throw Error(Code::invalid_argument, std::string("the name of ") + what +
                                            " of an OpenEXR picture has 1 to 255 bytes, '" + name.substr(0, 40) +
                                            "' has not");
  }
}

Imf::Header make_header(const Image& image) {
  Imf::Header header(image.width, image.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  for (const auto& [name, text] : image.attributes) {
    require_name(name, "an attribute");
    if (is_exr_format_attribute(name)) {
      throw Error(Code::invalid_argument, "the attribute '" + name + "' belongs to the OpenEXR format itself");
    }
    header.insert(name.c_str(), Imf::StringAttribute(text));
  }
  std::set<std::string> names;
  for (const Channel& channel : image.channels) {
    require_name(channel.name, "a channel");
    if (!names.insert(channel.name).second) {
      throw Error(Code::invalid_argument, "the picture has two channels named '" + channel.name + "'");
    }
    header.channels().insert(channel.name.c_str(), Imf::Channel(Imf::FLOAT));
  }
  return header;
}

}  // namespace

bool is_exr_format_attribute(const std::string& name) {
  static const std::set<std::string> kOptional{"chunkCount", "name", "preview", "tiles", "type", "version", "view"};
  static const Imf::Header kRequired;
  return kOptional.contains(name) || kRequired.find(name.c_str()) != kRequired.end();
}

void write_exr(AtomicFile& file, const Image& image) {
  Imf::FrameBuffer planes;
  const Imf::Header header = [&] {
    try {
      return make_header(image);
    } catch (const Error&) {
      throw;
    } catch (const std::exception& e) {
      throw Error(Code::invalid_argument, std::string("OpenEXR does not take this picture: ") + e.what());
    }
  }();
  for (const Channel& channel : image.channels) {
    // OpenEXR only reads through this pointer, though its type does not say so.
    char* base = const_cast<char*>(reinterpret_cast<const char*>(channel.values.data()));
    planes.insert(channel.name.c_str(), Imf::Slice(Imf::FLOAT, base, sizeof(float), sizeof(float) * image.width));
  }

  ExrOutput output(file);
  // Its destructor writes the line offsets and swallows errors: the AtomicFile remembers them for commit().
  Imf::OutputFile exr(output, header);
  exr.setFrameBuffer(planes);
  exr.writePixels(image.height);
}

}  // namespace lightcuts
