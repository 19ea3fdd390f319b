#pragma once

#include <cstddef>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "io/gltf_json.h"

namespace lightcuts::gltf {

/// Sentences for the user, each kept once, in the order of their coming.
class Warnings {
 public:
  void add(const std::string& sentence) {
    if (said_.insert(sentence).second) sentences_.push_back(sentence);
  }
  /// Adds `sentence` unless one with this key was added before: for what may be found at thousands of places.
  void add_once(const std::string& key, const std::string& sentence) {
    if (said_.insert(key).second) sentences_.push_back(sentence);
  }
  [[nodiscard]] std::vector<std::string> take() { return std::move(sentences_); }

 private:
  std::set<std::string> said_;
  std::vector<std::string> sentences_;
};

/// What a file may make us allocate: a fixed amount and so many times the bytes that it has.
///
/// Compression, sparse accessors without data and thousands of users of one buffer all let a small file ask for much.
class MemoryBudget {
 public:
  /// More bytes were read from disk.
  void add_input(std::size_t bytes) { limit_ += bytes * kFactor; }
  /// Throws Error{out_of_memory} at `where` if `bytes` more are too many.
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
