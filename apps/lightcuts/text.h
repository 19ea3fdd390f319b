#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace lightcuts::app {

/// "1 234 567": digits in groups of three.
std::string grouped(std::uint64_t number);

/// "3.2 MiB".
std::string readable_bytes(std::uint64_t bytes);

/// "12 s", "3 min 05 s", "2 h 10 min".
std::string readable_seconds(double seconds);

/// The word as a POSIX shell needs it to stay one word.
std::string shell_quoted(std::string_view word);

/// Insertions, deletions, replacements and swaps of neighbours that lead from one word to the other.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The candidate that a person who typed `word` most likely meant; empty if none is near.
std::string nearest(std::string_view word, const std::vector<std::string>& candidates);

/// "; did you mean 'X'?", or nothing.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates);

/// "a, b or c".
std::string either(const std::vector<std::string>& words);

}  // namespace lightcuts::app
