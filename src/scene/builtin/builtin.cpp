#include "scene/builtin/builtin.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>

#include "lightcuts/error.h"

namespace lightcuts {
namespace {

struct Builtin {
  BuiltinInfo info;
  Scene (*make)(const BuiltinOptions&);
};

const std::vector<Builtin>& table() {
  static const std::vector<Builtin> scenes = {
      {{"cornell", "the Cornell box by its measured geometry and spectra (Cornell University, 1998), in metres", {}},
       make_cornell},
      {{"furnace",
        "a closed box whose walls all emit and reflect alike; after B bounces every pixel is L (1 - r^(B+2)) / (1 - r)",
        {{"albedo", "0.5", "r, what every wall reflects, 0 to 0.999"},
         {"emission", "1", "L, the radiance that every wall emits [W/(m^2 sr)]"},
         {"size", "2", "edge of the box [m]"}}},
       make_furnace},
      {{"interior",
        "a furnished living room: textures, curved furniture, lamps, a wall of windows; the demo's picture",
        {{"light", "sun", "sun: a low sun and a clear sky; lamp: the lamps at dusk"}}},
       make_interior},
      {{"lamps",
        "a hall lit by many small lamps of constant power in all",
        {{"count", "1000", "lamps, 1 to 1000000"}, {"kind", "point", "point lights, or quad: small emitting squares"}}},
       make_lamps},
      {{"study", "a closed room of 10 x 5 x 10 m with an area light in the ceiling and 40 boxes", {}}, make_study},
  };
  return scenes;
}

std::string known_names() {
  std::vector<std::string> names;
  for (const Builtin& scene : table()) names.push_back(scene.info.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string known_keys(const BuiltinInfo& info) {
  if (info.keys.empty()) return "it has no keys";
  std::vector<std::string> keys;
  for (const BuiltinKey& key : info.keys) keys.push_back(key.name);
  return fmt::format("its keys are {}", fmt::join(keys, ", "));
}

/// Parses all of `text`; false if something is left or out of the type's range.
template <class Number>
bool parse(const std::string& text, Number& value) {
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  return error == std::errc{} && rest == end;
}

}  // namespace

BuiltinOptions::BuiltinOptions(const BuiltinInfo& info, std::string_view query) : scene_(info.name) {
  while (!query.empty()) {
    const std::string_view pair = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(query.size(), pair.size() + 1));
    const std::string key(pair.substr(0, pair.find('=')));
    const bool known =
        std::any_of(info.keys.begin(), info.keys.end(), [&](const BuiltinKey& k) { return k.name == key; });
    if (!known) {
      throw Error(Code::invalid_argument,
                  fmt::format("the built-in scene {} has no key \"{}\"; {}.", scene_, key, known_keys(info)));
    }
    if (pair.size() == key.size()) refuse(key, "a value: " + key + "=VALUE");
    if (!values_.emplace(key, pair.substr(key.size() + 1)).second) refuse(key, "to be given once");
  }
  for (const BuiltinKey& key : info.keys) values_.emplace(key.name, key.default_value);
}

void BuiltinOptions::refuse(const std::string& key, const std::string& expected) const {
  throw Error(Code::invalid_argument, fmt::format("the built-in scene {}: {} expects {}.", scene_, key, expected));
}

float BuiltinOptions::number(const std::string& key, float lo, float hi) const {
  float value = 0;
  if (!parse(values_.at(key), value) || !(value >= lo && value <= hi)) {
    refuse(key, fmt::format("a number from {:g} to {:g}, not \"{}\"", lo, hi, values_.at(key)));
  }
  return value;
}

std::uint64_t BuiltinOptions::integer(const std::string& key, std::uint64_t lo, std::uint64_t hi) const {
  std::uint64_t value = 0;
  if (!parse(values_.at(key), value) || value < lo || value > hi) {
    refuse(key, fmt::format("a whole number from {} to {}, not \"{}\"", lo, hi, values_.at(key)));
  }
  return value;
}

std::string BuiltinOptions::choice(const std::string& key, std::initializer_list<const char*> words) const {
  const std::string& value = values_.at(key);
  if (std::find(words.begin(), words.end(), value) == words.end()) {
    refuse(key, fmt::format("{}, not \"{}\"", fmt::join(words, " or "), value));
  }
  return value;
}

const std::vector<BuiltinInfo>& builtin_scenes() {
  static const std::vector<BuiltinInfo> infos = [] {
    std::vector<BuiltinInfo> result;
    for (const Builtin& scene : table()) result.push_back(scene.info);
    return result;
  }();
  return infos;
}

Scene make_builtin_scene(const std::string& spec) {
  const std::size_t mark = spec.find('?');
  const std::string name = spec.substr(0, mark);
  const auto found =
      std::find_if(table().begin(), table().end(), [&](const Builtin& scene) { return scene.info.name == name; });
  if (found == table().end()) {
    throw Error(Code::invalid_argument,
                fmt::format("there is no built-in scene \"{}\"; there are {}.", name, known_names()));
  }
  const std::string_view query =
      mark == std::string::npos ? std::string_view{} : std::string_view(spec).substr(mark + 1);
  Scene scene = found->make(BuiltinOptions(found->info, query));
  scene.name = name;
  return scene;
}

}  // namespace lightcuts
