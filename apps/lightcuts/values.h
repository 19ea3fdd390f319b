#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lightcuts/error.h"
#include "lightcuts/math.h"
#include "text.h"

namespace lightcuts::app {

// Values as they are written on a command line. Each function takes all of the text or throws Error{invalid_argument}
// with a sentence that says what was expected.

/// A finite number of [lo, hi].
double parse_number(const std::string& text, double lo, double hi);

/// A whole number of [lo, hi]; 1e6 is understood.
std::uint64_t parse_count(const std::string& text, std::uint64_t lo, std::uint64_t hi);

/// "WxH", each 1 to 65536 pixels.
std::pair<int, int> parse_size(const std::string& text);

/// Bytes with a unit: 512M, 4G, 4GiB, 1.5GB. One letter and "iB" count by 1024, "B" after a letter by 1000.
std::uint64_t parse_bytes(const std::string& text);

/// A number of bounces, or "inf".
int parse_bounces(const std::string& text);

/// "X,Y,Z".
Vec3 parse_vector(const std::string& text);

/// "R,G,B" or one number (linear, >= 0), or "#rrggbb" (sRGB); nullopt if the text is none of these.
std::optional<Vec3> parse_colour(const std::string& text);

/// "auto" (nullopt) or a number of stops.
std::optional<float> parse_exposure(const std::string& text);

/// A value with a name.
template <class T>
struct Choice {
  const char* name;
  T value;
};

/// Value of one of the names.
template <class T>
T parse_choice(const std::string& text, const std::vector<Choice<T>>& choices) {
  std::vector<std::string> names;
  for (const Choice<T>& choice : choices) {
    if (choice.name == text) return choice.value;
    names.emplace_back(choice.name);
  }
  throw Error(Code::invalid_argument, "expected " + either(names) + ", not '" + text + "'" + did_you_mean(text, names));
}

template <class T>
const char* name_of(T value, const std::vector<Choice<T>>& choices) {
  for (const Choice<T>& choice : choices) {
    if (choice.value == value) return choice.name;
  }
  return "?";
}

}  // namespace lightcuts::app
