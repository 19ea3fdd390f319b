#include "io/obj_mtl.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace lightcuts::obj {
namespace {

class MtlParser {
 public:
  MtlParser(const std::filesystem::path& path, Notes& notes) : reader_(path), notes_(notes) {}

  std::vector<MtlMaterial> run() {
    bool first = true;
    while (std::optional<std::string_view> line = reader_.next()) {
      if (std::exchange(first, false) && line->starts_with("\xef\xbb\xbf")) line->remove_prefix(3);
      Words words(*line);
      const std::string_view keyword = words.next();
      if (keyword == "newmtl") {
        materials_.emplace_back().name = words.rest();
      } else if (!materials_.empty()) {
        statement(keyword, words, materials_.back());
      }
    }
    return std::move(materials_);
  }

 private:
  void statement(std::string_view keyword, Words& words, MtlMaterial& material) {
    if (keyword == "Kd") {
      material.kd = color(words);
    } else if (keyword == "Ke") {
      material.ke = color(words);
    } else if (keyword == "d") {
      std::string_view word = words.next();
      if (word == "-halo") word = words.next();
      material.opacity = number(word);
      material.has_d = true;
    } else if (keyword == "Tr") {
      // Both say the same, and files that have both disagree: d is the older word.
      const auto transparency = number(words.next());
      if (!material.has_d && transparency) material.opacity = 1 - *transparency;
    } else if (keyword == "Pm") {
      material.metallic = number(words.next());
    } else if (keyword == "Pr") {
      material.roughness = number(words.next());
    } else if (keyword == "map_Kd") {
      material.map_kd = map(words);
    } else if (keyword == "map_Ke" || keyword == "map_emissive") {
      material.map_ke = map(words);
    } else if (keyword == "map_d") {
      material.map_d = map(words);
    }
  }

  std::optional<float> number(std::string_view word) {
    const float value = to_float(word);
    if (std::isfinite(value)) return value;
    note("a number is missing, no number, or not finite; it is ignored");
    return {};
  }

  /// r [g b]; one number is a grey.
  std::optional<Vec3> color(Words& words) {
    const std::string_view first = words.next();
    if (first == "spectral" || first == "xyz") {
      note("colours as spectra or in XYZ are ignored: write them as r g b");
      return {};
    }
    const auto r = number(first);
    const std::string_view second = words.next();
    if (!r || second.empty()) return r ? std::optional(Vec3{*r, *r, *r}) : std::nullopt;
    const auto g = number(second), b = number(words.next());
    if (!g || !b) return {};
    return Vec3{*r, *g, *b};
  }

  MtlMap map(Words words) {
    MtlMap result;
    for (Words ahead = words;; words = ahead) {
      const std::string_view option = ahead.next();
      if (!take_option(option, ahead, result)) break;
    }
    result.text = words.rest();
    if (!result.present()) note("a texture has no file name; it is ignored");
    return result;
  }

  /// False if `option` is none, but begins the file's name.
  static bool take_option(std::string_view option, Words& words, MtlMap& map) {
    if (option == "-clamp") {
      map.clamp = words.next() == "on";
    } else if (option == "-o" || option == "-s" || option == "-t") {
      take_vector(words, option == "-o" ? map.offset.data() : option == "-s" ? map.scale.data() : nullptr);
    } else if (option == "-mm") {
      words.next();
      words.next();
    } else if (option == "-blendu" || option == "-blendv" || option == "-cc" || option == "-bm" || option == "-boost" ||
               option == "-texres" || option == "-type" || option == "-imfchan" || option == "-colorspace") {
      words.next();
    } else {
      return false;
    }
    return true;
  }

  /// u [v [w]]: what is no number any more belongs to the file's name.
  static void take_vector(Words& words, float* target) {
    for (int i = 0; i < 3; ++i) {
      Words ahead = words;
      const float value = to_float(ahead.next());
      if (!std::isfinite(value)) return;
      if (target != nullptr && i < 2) target[i] = value;
      words = ahead;
    }
  }

  void note(const char* what) { notes_.add(what, reader_.line()); }

  LineReader reader_;
  Notes& notes_;
  std::vector<MtlMaterial> materials_;
};

}  // namespace

std::vector<MtlMaterial> parse_mtl(const std::filesystem::path& path, Notes& notes) {
  return MtlParser(path, notes).run();
}

}  // namespace lightcuts::obj
