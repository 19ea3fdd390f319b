#pragma once

#include <charconv>
#include <optional>
#include <string_view>

namespace lightcuts {

/// The number that `text` is, spaces around it and a leading '+' allowed; independent of the locale.
/// Nothing where it is no number, where something follows it, or where a double cannot hold it.
inline std::optional<double> parse_number(std::string_view text) {
  constexpr std::string_view kSpaces = " \t\r\v\f";
  const std::size_t begin = text.find_first_not_of(kSpaces);
  if (begin == std::string_view::npos) return {};
  text = text.substr(begin, text.find_last_not_of(kSpaces) - begin + 1);
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  return value;
}

}  // namespace lightcuts
