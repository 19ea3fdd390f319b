#include "io/gltf_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace lightcuts::gltf {
namespace {

using nlohmann::json;

constexpr std::uint64_t kLargestExact = std::uint64_t{1} << 53;  // above it a double may have lost digits

/// A value on the way down and which of its children comes next.
struct Level {
  const json* value;
  json::const_iterator next;
};

std::string step_name(const json& parent, const json::const_iterator& child) {
  if (parent.is_object()) return "." + readable_name(child.key());
  return fmt::format("[{}]", child - parent.begin());
}

}  // namespace

std::string readable_name(std::string text) {
  constexpr std::size_t kLongest = 128;
  if (text.size() > kLongest) {
    std::size_t end = kLongest;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0u) == 0x80u) --end;  // not inside a UTF-8 character
    text.resize(end);
  }
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  }
  return text;
}

JsonDocument::JsonDocument(std::string file, std::string_view text) : file_(std::move(file)) {
  try {
    root_ = json::parse(text.begin(), text.end());
  } catch (const json::exception& error) {
    throw Error(Code::malformed, fmt::format("{}: this is no valid JSON ({}). Export the scene again.", file_,
                                             readable_name(error.what())));
  }
  if (!root_.is_object()) {
    throw Error(Code::malformed, fmt::format("{}: expected a JSON object at the top. Is this a glTF file?", file_));
  }
}

JsonValue JsonDocument::root() const { return {*this, &root_}; }

std::string JsonDocument::path_of(const json* value) const {
  std::vector<Level> levels;
  if (value != &root_) levels.push_back({&root_, root_.begin()});
  while (!levels.empty()) {
    Level& level = levels.back();
    if (level.next == level.value->end()) {
      levels.pop_back();
      continue;
    }
    const json* child = &*level.next++;
    if (child == value) break;
    if (child->is_structured()) levels.push_back({child, child->begin()});
  }
  std::string path;
  for (const Level& level : levels) {
    auto taken = level.next;
    path += step_name(*level.value, --taken);
  }
  return path.empty() ? "top level" : path.substr(path[0] == '.' ? 1 : 0);
}

std::string JsonValue::locate(const std::string& text) const {
  return fmt::format("{}: {}: {}", document_->file(), document_->path_of(value_), text);
}

void JsonValue::fail(const std::string& text, Code code) const { throw Error(code, locate(text)); }

JsonValue JsonValue::find(const char* key) const {
  if (value_ == nullptr) return *this;
  if (!value_->is_object())
    fail(fmt::format("expected an object, found {}. Export the scene again.", value_->type_name()));
  const auto member = value_->find(key);
  return {*document_, member == value_->end() ? nullptr : &*member};
}

JsonValue JsonValue::require(const char* key) const {
  const JsonValue member = find(key);
  if (!member) fail(fmt::format("`{}` is missing. Export the scene again.", key));
  return member;
}

std::size_t JsonValue::size() const {
  if (value_ == nullptr) return 0;
  if (!value_->is_array())
    fail(fmt::format("expected an array, found {}. Export the scene again.", value_->type_name()));
  return value_->size();
}

JsonValue JsonValue::operator[](std::size_t index) const { return {*document_, &(*value_)[index]}; }

double JsonValue::number() const {
  if (!value_->is_number()) fail(fmt::format("expected a number, found {}.", value_->type_name()));
  const double number = value_->get<double>();
  if (!(std::abs(number) <= std::numeric_limits<float>::max())) {
    fail(fmt::format("{} is out of the range of a float. Correct or remove it.", number));
  }
  return number;
}

double JsonValue::number_or(double value) const { return value_ == nullptr ? value : number(); }

bool JsonValue::boolean_or(bool value) const {
  if (value_ == nullptr) return value;
  if (!value_->is_boolean()) fail(fmt::format("expected true or false, found {}.", value_->type_name()));
  return value_->get<bool>();
}

std::string JsonValue::string() const {
  if (!value_->is_string()) fail(fmt::format("expected a string, found {}.", value_->type_name()));
  return value_->get<std::string>();
}

std::string JsonValue::string_or(const char* text) const { return value_ == nullptr ? text : string(); }

std::string JsonValue::name() const {
  const JsonValue member = find("name");
  return member && member.value_->is_string() ? readable_name(member.string()) : std::string();
}

std::uint64_t JsonValue::count() const {
  if (value_->is_number_unsigned()) return value_->get<std::uint64_t>();
  if (value_->is_number_float()) {
    const double number = value_->get<double>();
    if (number >= 0 && number <= static_cast<double>(kLargestExact) && number == std::floor(number)) {
      return static_cast<std::uint64_t>(number);
    }
  }
  fail(fmt::format("expected an integer that is not negative, found {}.",
                   value_->is_number() ? readable_name(value_->dump()) : value_->type_name()));
}

std::uint64_t JsonValue::count_or(std::uint64_t value) const { return value_ == nullptr ? value : count(); }

std::uint32_t JsonValue::index_in(const JsonValue& array, const char* what) const {
  const std::uint64_t index = count();
  const std::size_t size = std::min<std::size_t>(array.size(), std::numeric_limits<std::uint32_t>::max());
  if (index >= size)
    fail(fmt::format("{} is not the index of {}: there are {}. Export the scene again.", index, what, size));
  return static_cast<std::uint32_t>(index);
}

JsonValue JsonValue::follow(const JsonValue& array, const char* what) const { return array[index_in(array, what)]; }

void JsonValue::numbers(float* out, std::size_t length) const {
  if (size() != length) fail(fmt::format("expected {} numbers, found {}.", length, size()));
  for (std::size_t i = 0; i < length; ++i) out[i] = static_cast<float>((*this)[i].number());
}

const json::object_t& JsonValue::members() const {
  static const json::object_t kNoMembers;
  if (value_ == nullptr) return kNoMembers;
  if (!value_->is_object()) fail(fmt::format("expected an object, found {}.", value_->type_name()));
  return value_->get_ref<const json::object_t&>();
}

}  // namespace lightcuts::gltf
