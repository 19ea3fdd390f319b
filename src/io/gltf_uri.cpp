#include "io/gltf_uri.h"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <limits>
#include <system_error>

#include "io/read_file.h"

namespace lightcuts::gltf {
namespace {

constexpr int kNoDigit = -1;

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  const char lower = static_cast<char>(c | 0x20);
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : kNoDigit;
}

/// Replaces %XX; a percent sign without two hexadecimal digits stays, as careless exporters mean it so.
std::string percent_decoded(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size() && hex_digit(text[i + 1]) >= 0 && hex_digit(text[i + 2]) >= 0) {
      out += static_cast<char>(hex_digit(text[i + 1]) * 16 + hex_digit(text[i + 2]));
      i += 2;
    } else {
      out += text[i];
    }
  }
  return out;
}

std::array<std::int16_t, 256> make_base64_digits() {
  std::array<std::int16_t, 256> digits{};
  digits.fill(-1);
  constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < kAlphabet.size(); ++i) {
    digits[static_cast<unsigned char>(kAlphabet[i])] = static_cast<std::int16_t>(i);
  }
  return digits;
}

/// Empty result and false for a text that is not base64. Padding may be left out.
bool base64_decoded(std::string_view text, Bytes& out) {
  static const std::array<std::int16_t, 256> kDigits = make_base64_digits();
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  if (text.size() % 4 == 1) return false;
  out.reserve(text.size() / 4 * 3 + 2);
  std::uint32_t bits = 0;
  int held = 0;
  for (const char c : text) {
    const int digit = kDigits[static_cast<unsigned char>(c)];
    if (digit < 0) return false;
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    held += 6;
    if (held >= 8) {
      held -= 8;
      out.push_back(static_cast<std::byte>(bits >> held & 0xffu));
    }
  }
  return true;
}

Bytes read_data_uri(const JsonValue& where, std::string_view uri) {
  const std::size_t comma = uri.find(',');
  if (comma == std::string_view::npos) where.fail("the data URI has no comma and so no data. Export the scene again.");
  const std::string_view head = uri.substr(0, comma);
  const std::string_view data = uri.substr(comma + 1);
  Bytes bytes;
  if (head.ends_with(";base64")) {
    // The whole is decoded from percents only where there are some: base64 has none by itself.
    const bool escaped = data.find('%') != std::string_view::npos;
    if (!base64_decoded(escaped ? percent_decoded(data) : data, bytes)) {
      where.fail("the data URI is not valid base64. Export the scene again.");
    }
  } else {
    const std::string text = percent_decoded(data);
    const auto* first = reinterpret_cast<const std::byte*>(text.data());
    bytes.assign(first, first + text.size());
  }
  return bytes;
}

/// True for "http:", "file:", "C:" and the like.
bool has_scheme(std::string_view uri) {
  const std::size_t colon = uri.find(':');
  if (colon == std::string_view::npos || colon == 0) return false;
  for (const char c : uri.substr(0, colon)) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '+' && c != '-' && c != '.') return false;
  }
  return true;
}

/// True if a relative path names something below the folder it starts from, by its text alone.
bool stays_below(const std::filesystem::path& path) {
  int depth = 0;
  for (const auto& part : path) {
    if (part == "..") {
      if (--depth < 0) return false;
    } else if (part != "." && !part.empty()) {
      ++depth;
    }
  }
  return depth > 0;
}

std::filesystem::path safe_path(const JsonValue& where, const std::string& uri, const std::filesystem::path& folder) {
  if (has_scheme(uri)) {
    where.fail(fmt::format("\"{}\" is not a file of the scene's folder; nothing is fetched from elsewhere. Store the "
                           "file beside the scene.",
                           uri_name(uri)),
               Code::unsupported);
  }
  const std::string name = percent_decoded(uri);
  if (name.empty() || name.find('\0') != std::string::npos) where.fail("this is not the name of a file.");
  const std::filesystem::path relative(name);
  if (relative.is_absolute() || name[0] == '\\' || !stays_below(relative)) {
    where.fail(fmt::format("\"{}\" lies outside the scene's folder and is not read. Store the file beside the scene.",
                           readable_name(name)),
               Code::unsupported);
  }
  return folder / relative;
}

}  // namespace

std::string uri_name(const std::string& uri) {
  return uri.starts_with("data:") ? "embedded" : readable_name(percent_decoded(uri));
}

Bytes read_regular_file(const std::filesystem::path& path, const std::string& name) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    throw Error(Code::file_missing,
                fmt::format("{}: there is no such file. Check the name and that it lies there.", name));
  }
  return lightcuts::read_file(path, std::numeric_limits<std::uint64_t>::max() / 2);
}

Bytes read_uri(const JsonValue& uri, const std::filesystem::path& folder) {
  const std::string text = uri.string();
  if (text.starts_with("data:")) return read_data_uri(uri, text);
  const std::filesystem::path path = safe_path(uri, text, folder);
  return read_regular_file(path, uri.locate(uri_name(text)));
}

}  // namespace lightcuts::gltf
