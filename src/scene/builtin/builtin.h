#pragma once

#include <cstdint>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>

#include "lightcuts/scene.h"

// What the files of the built-in scenes share: one file a scene, one line in the table of builtin.cpp.

namespace lightcuts {

/// The keys of a specification with their values, defaults filled in. Every getter throws Error{invalid_argument} that
/// names the scene, the key and what it expects.
class BuiltinOptions {
 public:
  /// Parses "key=value&key=value". Throws Error{invalid_argument} for an unknown or repeated key.
  BuiltinOptions(const BuiltinInfo& info, std::string_view query);

  /// A number in [lo, hi].
  [[nodiscard]] float number(const std::string& key, float lo, float hi) const;
  /// A whole number in [lo, hi].
  [[nodiscard]] std::uint64_t integer(const std::string& key, std::uint64_t lo, std::uint64_t hi) const;
  /// One of some words.
  [[nodiscard]] std::string choice(const std::string& key, std::initializer_list<const char*> words) const;

 private:
  [[noreturn]] void refuse(const std::string& key, const std::string& expected) const;

  std::string scene_;
  std::map<std::string, std::string> values_;
};

Scene make_cornell(const BuiltinOptions& options);
Scene make_furnace(const BuiltinOptions& options);
Scene make_interior(const BuiltinOptions& options);
Scene make_lamps(const BuiltinOptions& options);
Scene make_study(const BuiltinOptions& options);

}  // namespace lightcuts
