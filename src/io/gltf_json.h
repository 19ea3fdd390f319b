#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "lightcuts/error.h"

namespace lightcuts::gltf {

class JsonValue;

/// A parsed JSON text that knows its file's name.
class JsonDocument {
 public:
  /// Throws Error{malformed} naming line and column if the text is no JSON object.
  JsonDocument(std::string file, std::string_view text);

  [[nodiscard]] JsonValue root() const;
  [[nodiscard]] const std::string& file() const { return file_; }

  /// Where a value stands, e.g. `accessors[3].byteOffset`. Found by search: paths are needed in messages only.
  [[nodiscard]] std::string path_of(const nlohmann::json* value) const;

 private:
  std::string file_;
  nlohmann::json root_;
};

/// One value of a document, or an absent one. Every access is checked, and a failed check says where and what.
class JsonValue {
 public:
  JsonValue() = default;
  JsonValue(const JsonDocument& document, const nlohmann::json* value) : document_(&document), value_(value) {}

  /// False for an optional member that is not there.
  explicit operator bool() const { return value_ != nullptr; }
  [[nodiscard]] bool same_as(const JsonValue& other) const { return value_ == other.value_; }

  /// Member of an object, absent if there is none. An absent value has absent members.
  [[nodiscard]] JsonValue find(const char* key) const;
  /// Member of an object that must be there.
  [[nodiscard]] JsonValue require(const char* key) const;

  /// Length of an array; 0 if absent.
  [[nodiscard]] std::size_t size() const;
  /// Element of an array, `index` below size().
  [[nodiscard]] JsonValue operator[](std::size_t index) const;

  [[nodiscard]] double number() const;                 ///< finite, also as a float
  [[nodiscard]] double number_or(double value) const;  ///< `value` if absent
  [[nodiscard]] bool boolean_or(bool value) const;
  [[nodiscard]] std::string string() const;
  [[nodiscard]] std::string string_or(const char* text) const;
  /// The `name` of an object, made readable; empty if there is none: names are not worth refusing a file for.
  [[nodiscard]] std::string name() const;
  [[nodiscard]] std::uint64_t count() const;  ///< an integer that is not negative, also written as 3.0
  [[nodiscard]] std::uint64_t count_or(std::uint64_t value) const;
  /// This as an index into `array`; `what` says of what kind: "an accessor".
  [[nodiscard]] std::uint32_t index_in(const JsonValue& array, const char* what) const;
  /// The element of `array` that this index names.
  [[nodiscard]] JsonValue follow(const JsonValue& array, const char* what) const;
  /// Fills `out` with an array of exactly `length` numbers.
  void numbers(float* out, std::size_t length) const;
  /// Members of an object; none if absent.
  [[nodiscard]] const nlohmann::json::object_t& members() const;
  [[nodiscard]] bool is_object() const { return value_ != nullptr && value_->is_object(); }

  /// "file: path: text"
  [[nodiscard]] std::string locate(const std::string& text) const;
  /// Throws Error{code} with `locate(text)`.
  [[noreturn]] void fail(const std::string& text, Code code = Code::malformed) const;
  [[nodiscard]] const JsonDocument& document() const { return *document_; }

 private:
  const JsonDocument* document_ = nullptr;
  const nlohmann::json* value_ = nullptr;
};

/// A name that is fit for messages and for a screen: at most 128 bytes, control characters replaced.
std::string readable_name(std::string text);

}  // namespace lightcuts::gltf
