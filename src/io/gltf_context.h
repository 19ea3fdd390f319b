#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "io/gltf_json.h"

namespace lightcuts::gltf {

/// Sentences for the user, each kept once, in the order of their coming.
class Warnings {
 public:
  void add(const std::string& sentence);
  /// Adds what is found at a place of the file. After `most` of one kind the others are only counted: a large file may
  /// have a million, and finding the name of a place takes a search.
  void add_at(const JsonValue& where, const std::string& kind, const std::string& text, std::size_t most = 1);
  /// All sentences; the last one of a kind says how many more there were.
  [[nodiscard]] std::vector<std::string> take();

 private:
  struct Kind {
    std::size_t count = 0;
    std::size_t last = 0;  ///< index of the last sentence
    std::size_t most = 0;
  };
  std::set<std::string> said_;
  std::map<std::string, Kind> kinds_;
  std::vector<std::string> sentences_;
};

/// How many warnings of one kind are told with their places, where each place matters.
inline constexpr std::size_t kToldPlaces = 8;

/// What a file may make us allocate: a fixed amount and so many times the bytes that it has.
///
/// Compression, sparse accessors without data and thousands of users of one buffer all let a small file ask for much.
class MemoryBudget {
 public:
  /// More bytes were read from disk.
  void add_input(std::size_t bytes) { limit_ += bytes * kFactor; }
  /// Throws Error{unsupported} at `where` if `bytes` more are too many.
  void charge(std::uint64_t bytes, const JsonValue& where);

 private:
  static constexpr std::uint64_t kFloor = std::uint64_t{640} << 20;
  static constexpr std::uint64_t kFactor = 64;
  std::uint64_t limit_ = kFloor;
  std::uint64_t used_ = 0;
};

/// What every part of the loader needs.
struct Context {
  const JsonDocument& document;
  std::filesystem::path folder;  ///< of the scene's file
  Warnings warnings{};
  MemoryBudget budget{};

  /// Array at the top of the file, e.g. "accessors"; absent if there is none.
  [[nodiscard]] JsonValue array(const char* name) const { return document.root().find(name); }
};

}  // namespace lightcuts::gltf
