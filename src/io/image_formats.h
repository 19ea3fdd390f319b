#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "io/atomic_file.h"
#include "lightcuts/image.h"
#include "lightcuts/io.h"

namespace lightcuts {

/// Memory that a picture's planes may take, however few bytes its file has and however much there is [bytes]. A larger
/// picture is unsupported: bad input, not a lack of memory.
inline constexpr std::uint64_t kImageBudget = std::uint64_t{1} << 30;

/// OpenEXR: scan lines, ZIP, every plane as 32-bit float, attributes as strings.
/// Throws Error{invalid_argument, cannot_write, disk_full}; the caller commits.
void write_exr(AtomicFile& file, const Image& image);
/// True for an attribute that says how the file is laid out, which no picture may bring along as text.
bool is_exr_format_attribute(const std::string& name);
/// The first part's largest level, all channels as float, placed in the display window.
/// `name` is for messages. Throws Error{malformed, unsupported, out_of_memory}.
Image read_exr(std::span<const std::byte> bytes, const std::string& name);

/// Radiance RGBE with run lengths. Throws Error{invalid_argument} without R, G, B (or a grey plane).
std::string encode_hdr(const Image& image);
/// Throws Error{malformed, unsupported}.
Image read_hdr(std::span<const std::byte> bytes, const std::string& name);

/// A whole PNG file. Throws Error{invalid_argument, out_of_memory}.
std::vector<std::byte> encode_png(const DisplayImage& image);

}  // namespace lightcuts
