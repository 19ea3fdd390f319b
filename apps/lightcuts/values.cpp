#include "values.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "lightcuts/render.h"

namespace lightcuts::app {
namespace {

[[noreturn]] void refuse(const std::string& message) { throw Error(Code::invalid_argument, message); }

/// The whole text as a number, whatever its range; locale plays no part.
std::optional<double> number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (problem != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  while (true) {
    const std::size_t at = text.find(separator);
    parts.push_back(text.substr(0, at));
    if (at == std::string_view::npos) return parts;
    text.remove_prefix(at + 1);
  }
}

/// Three numbers between commas; nullopt if the text is anything else.
std::optional<Vec3> three_numbers(std::string_view text) {
  const auto parts = split(text, ',');
  if (parts.size() != 3) return std::nullopt;
  std::array<float, 3> values{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto value = number(parts[i]);
    if (!value || !std::isfinite(static_cast<float>(*value))) return std::nullopt;
    values[i] = static_cast<float>(*value);
  }
  return Vec3{values[0], values[1], values[2]};
}

float decode_srgb(int byte) {
  const double s = byte / 255.0;
  return static_cast<float>(s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4));
}

std::optional<Vec3> hex_colour(std::string_view text) {
  if (text.size() != 7 || text[0] != '#') return std::nullopt;
  unsigned rgb = 0;
  const auto [end, problem] = std::from_chars(text.data() + 1, text.data() + 7, rgb, 16);
  if (problem != std::errc() || end != text.data() + 7) return std::nullopt;
  return Vec3{decode_srgb(static_cast<int>(rgb >> 16)), decode_srgb(static_cast<int>(rgb >> 8 & 255)),
              decode_srgb(static_cast<int>(rgb & 255))};
}

/// Factor of a unit of bytes; nullopt if there is no such unit.
std::optional<double> byte_unit(std::string unit) {
  for (char& c : unit) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  if (unit.empty() || unit == "B") return 1;
  const std::size_t power = std::string_view("KMGT").find(unit[0]);
  if (power == std::string_view::npos) return std::nullopt;
  const std::string rest = unit.substr(1);
  const double exponent = static_cast<double>(power) + 1;
  if (rest == "B") return std::pow(1000.0, exponent);
  if (rest.empty() || rest == "IB") return std::pow(1024.0, exponent);
  return std::nullopt;
}

}  // namespace

double parse_number(const std::string& text, double lo, double hi) {
  const auto value = number(text);
  if (!value || *value < lo || *value > hi) {
    refuse(fmt::format("expected a number from {} to {}, not '{}'", lo, hi, text));
  }
  return *value;
}

std::uint64_t parse_count(const std::string& text, std::uint64_t lo, std::uint64_t hi) {
  // Digits are read exactly; other spellings of whole numbers (1e6) as far as a double holds them.
  std::uint64_t count = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), count);
  bool whole = problem == std::errc() && end == text.data() + text.size();
  if (!whole) {
    const auto value = number(text);
    whole = value && *value >= 0 && *value <= 9e15 && *value == std::floor(*value);
    if (whole) count = static_cast<std::uint64_t>(*value);
  }
  if (!whole || count < lo || count > hi) {
    refuse(fmt::format("expected a whole number from {} to {}, not '{}'", lo, hi, text));
  }
  return count;
}

std::pair<int, int> parse_size(const std::string& text) {
  const auto parts = split(text, text.find('X') != std::string::npos ? 'X' : 'x');
  try {
    if (parts.size() == 2) {
      return {static_cast<int>(parse_count(std::string(parts[0]), 1, 65536)),
              static_cast<int>(parse_count(std::string(parts[1]), 1, 65536))};
    }
  } catch (const Error&) {
    // Said below, for both numbers at once.
  }
  refuse(fmt::format("expected WIDTHxHEIGHT in pixels, each 1 to 65536, e.g. 640x480, not '{}'", text));
}

std::uint64_t parse_bytes(const std::string& text) {
  const std::size_t digits = std::min(text.find_first_not_of("0123456789.+"), text.size());
  const auto value = number(std::string_view(text).substr(0, digits));
  const auto unit = byte_unit(text.substr(digits));
  if (!value || !unit || *value * *unit < 1 || *value * *unit > 1e18) {
    refuse(fmt::format("expected a size such as 512M, 4G or 4GiB, not '{}'", text));
  }
  return static_cast<std::uint64_t>(*value * *unit);
}

int parse_bounces(const std::string& text) {
  if (text == "inf") return kUnlimitedBounces;
  try {
    return static_cast<int>(parse_count(text, 0, 1000000));
  } catch (const Error&) {
    refuse(fmt::format("expected a number of bounces from 0 on, or inf, not '{}'", text));
  }
}

Vec3 parse_vector(const std::string& text) {
  const auto value = three_numbers(text);
  if (!value) refuse(fmt::format("expected three numbers X,Y,Z without spaces, e.g. 0,1.5,4, not '{}'", text));
  return *value;
}

std::optional<Vec3> parse_colour(const std::string& text) {
  std::optional<Vec3> colour = hex_colour(text);
  if (!colour) colour = three_numbers(text);
  if (const auto grey = number(text); !colour && grey) {
    const auto value = static_cast<float>(*grey);
    colour = Vec3{value, value, value};
  }
  if (colour && (!is_finite(*colour) || colour->x < 0 || colour->y < 0 || colour->z < 0)) {
    refuse(fmt::format("expected a colour whose parts are at least 0, not '{}'", text));
  }
  return colour;
}

std::optional<float> parse_exposure(const std::string& text) {
  if (text == "auto") return std::nullopt;
  try {
    return static_cast<float>(parse_number(text, -100, 100));
  } catch (const Error&) {
    refuse(fmt::format("expected auto or a number of stops from -100 to 100, e.g. 1.5, not '{}'", text));
  }
}

}  // namespace lightcuts::app
