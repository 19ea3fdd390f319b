// Why our own reader: Debian 12's tinyobjloader (2.0.0rc10) keeps a face's corner count in one byte, so that a polygon of
// 300 corners shifts all faces behind it, refuses a whole file for one index of zero, and holds a heap block a face, which
// costs gigabytes for ten million triangles. Reading the text is a small part of the work: checking indices, leaving out
// single faces with a note, cutting polygons and sharing corners would be ours in any case.

#include "io/obj_parse.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "io/obj_triangulate.h"
#include "lightcuts/error.h"

namespace lightcuts::obj {
namespace {

/// Vertex colours of OBJ files are display colours; meshes hold linear ones. Source: IEC 61966-2-1 (sRGB).
std::uint8_t linear_byte(float srgb) {
  if (!(srgb > 0)) return 0;
  const float v = std::fmin(srgb, 1.0f);
  const float linear = v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f);
  return static_cast<std::uint8_t>(std::lround(255 * linear));
}

class Parser {
 public:
  Parser(const std::filesystem::path& path, Notes& notes) : path_(path), reader_(path), notes_(notes) {}

  Data run() {
    bool first = true;
    while (std::optional<std::string_view> line = reader_.next()) {
      if (std::exchange(first, false) && line->starts_with("\xef\xbb\xbf")) line->remove_prefix(3);
      Words words(*line);
      const std::string_view keyword = words.next();
      if (keyword.empty() || keyword.front() == '#') continue;
      statement(keyword, words);
    }
    if (known_ == 0) {
      throw Error(
          Code::malformed,
          fmt::format("{}: not one line of it is an OBJ statement; expected lines like 'v 0 0 0' and 'f 1 2 3'.",
                      path_.string()));
    }
    if (triangulator_.gave_up()) {
      note(
          "its concave polygons have too many corners in all, the last ones were cut without care: cut them into "
          "triangles");
    }
    return std::move(data_);
  }

 private:
  void statement(std::string_view keyword, Words& words) {
    ++known_;
    if (keyword == "v") {
      vertex(words);
    } else if (keyword == "vt") {
      texcoord(words);
    } else if (keyword == "vn") {
      const Vec3 normal = vector(words);
      add(data_.normals, is_finite(normal) ? normal : Vec3{0, 0, 0});
    } else if (keyword == "f" || keyword == "fo") {
      face(words);
    } else if (keyword == "o" || keyword == "g") {
      name_ = words.rest();
      part_index_.reset();
    } else if (keyword == "usemtl") {
      use_material(words.rest());
    } else if (keyword == "mtllib") {
      if (libraries_.insert(std::string(words.rest())).second) data_.libraries.emplace_back(words.rest());
    } else if (keyword == "s") {
      smoothing_group(words.next());
    } else {
      other(keyword);
    }
  }

  void other(std::string_view keyword) {
    static const std::set<std::string_view> kQuiet{
        "p",   "l",      "vp",         "vw",        "t",   "bevel", "c_interp", "d_interp",
        "lod", "cstype", "shadow_obj", "trace_obj", "end", "mg",    "maplib",   "usemap"};
    static const std::set<std::string_view> kSurfaces{"curv", "curv2", "surf"};
    if (kSurfaces.contains(keyword)) {
      note("free-form curves and surfaces are left out: export triangles");
    } else if (!kQuiet.contains(keyword)) {
      --known_;
      note("the line begins with no word of the OBJ format and is ignored");
    }
  }

  // ---- vertices

  float number(std::string_view word) {
    const float value = to_float(word);
    if (!std::isfinite(value)) note("a number is missing, no number, or not finite");
    return value;
  }
  Vec3 vector(Words& words) {
    const float x = number(words.next()), y = number(words.next()), z = number(words.next());
    return {x, y, z};
  }

  /// x y z, x y z w, x y z r g b or x y z w r g b; w is a weight of free-form surfaces.
  void vertex(Words& words) {
    add(data_.positions, vector(words));
    std::array<float, 4> more{};
    std::size_t count = 0;
    for (std::string_view word = words.next(); !word.empty() && count < more.size(); word = words.next()) {
      more[count++] = to_float(word);
    }
    const bool colored = count >= 3;
    if (!colored && data_.colors.empty()) return;
    data_.colors.resize(data_.positions.size() - 1, {255, 255, 255, 255});
    const float* rgb = more.data() + (count == 4 ? 1 : 0);
    data_.colors.push_back(
        colored ? std::array<std::uint8_t, 4>{linear_byte(rgb[0]), linear_byte(rgb[1]), linear_byte(rgb[2]), 255}
                : std::array<std::uint8_t, 4>{255, 255, 255, 255});
  }

  void texcoord(Words& words) {
    const float u = number(words.next());
    const std::string_view second = words.next();
    const float v = second.empty() ? 0.0f : number(second);
    // The file's v points up.
    add(data_.texcoords, std::isfinite(u) && std::isfinite(v) ? Vec2{u, 1 - v} : Vec2{});
  }

  template <class T>
  void add(std::vector<T>& values, const T& value) {
    if (values.size() >= kSmoothBit - 1) {
      throw Error(Code::unsupported,
                  fmt::format("{}, line {}: more than 2^31 vertices; split the file.", path_.string(), reader_.line()));
    }
    values.push_back(value);
  }

  // ---- faces

  /// Index of a number counted from 1, or from the end where negative; nothing if it leads nowhere.
  static std::optional<std::uint32_t> index_of(std::string_view word, std::size_t count) {
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) return {};
    const auto size = static_cast<std::int64_t>(count);
    const std::int64_t index = value < 0 ? size + value : value - 1;
    if (value == 0 || value < -size || index >= size) return {};
    return static_cast<std::uint32_t>(index);
  }

  /// "7", "7/2", "7//3" or "7/2/3"; nothing if the position leads nowhere.
  std::optional<Corner> corner(std::string_view word) {
    const auto take = [&] {
      const std::size_t slash = std::min(word.find('/'), word.size());
      const std::string_view field = word.substr(0, slash);
      word.remove_prefix(std::min(slash + 1, word.size()));
      return field;
    };
    const auto position = index_of(take(), data_.positions.size());
    if (!position) return {};
    Corner corner{*position, kNone, smoothing_ == 0 ? kNone : kSmoothBit | smoothing_};
    if (const std::string_view field = take(); !field.empty()) {
      const auto index = index_of(field, data_.texcoords.size());
      if (!index) note("a face names texture coordinates that were not defined before it; it goes without");
      corner.texcoord = index.value_or(kNone);
    }
    if (const std::string_view field = take(); !field.empty()) {
      const auto index = index_of(field, data_.normals.size());
      if (!index) note("a face names a normal that was not defined before it; it goes without");
      if (index) corner.normal = *index;
    }
    return corner;
  }

  void face(Words& words) {
    face_.clear();
    for (std::string_view word = words.next(); !word.empty() && word.front() != '#'; word = words.next()) {
      const std::optional<Corner> next = corner(word);
      if (!next) {
        note("a face names a vertex that was not defined before it; the face is left out");
        return;
      }
      if (face_.empty() || face_.back().position != next->position) face_.push_back(*next);
    }
    while (face_.size() > 1 && face_.front().position == face_.back().position) face_.pop_back();
    if (face_.size() < 3) {
      note("a face has less than three different corners and is left out");
      return;
    }
    std::vector<Corner>& corners = part().corners;
    if (corners.size() > kNone - 3 * face_.size()) {
      throw Error(Code::unsupported, fmt::format("{}, line {}: more than 2^32 corners in one object; split it.",
                                                 path_.string(), reader_.line()));
    }
    if (face_.size() == 3) {
      corners.insert(corners.end(), face_.begin(), face_.end());
      return;
    }
    face_positions_.clear();
    for (const Corner& c : face_) face_positions_.push_back(data_.positions[c.position]);
    for (const auto& triangle : triangulator_.triangulate(face_positions_)) {
      for (const std::uint32_t i : triangle) corners.push_back(face_[i]);
    }
  }

  // ---- objects, materials, smoothing

  /// The part that faces go to, found again where an object or a material returns.
  Part& part() {
    if (part_index_) return data_.parts[*part_index_];
    const auto [found, added] = parts_.try_emplace({name_, material()}, data_.parts.size());
    if (added) data_.parts.push_back({name_, material(), {}});
    part_index_ = found->second;
    return data_.parts[*part_index_];
  }

  std::uint32_t material() {
    if (!material_) use_material("");
    return *material_;
  }

  void use_material(std::string_view name) {
    const auto [found, added] =
        materials_.try_emplace(std::string(name), static_cast<std::uint32_t>(materials_.size()));
    if (added) data_.material_names.emplace_back(name);
    material_ = found->second;
    part_index_.reset();
  }

  void smoothing_group(std::string_view word) {
    std::uint32_t group = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), group);
    const bool usable = error == std::errc() && end == word.data() + word.size() && group < kSmoothBit - 1;
    if (!usable && word != "off") note("a smoothing group is no number; smoothing is off");
    smoothing_ = usable ? group : 0;
  }

  void note(const char* what) { notes_.add(what, reader_.line()); }

  const std::filesystem::path& path_;
  LineReader reader_;
  Notes& notes_;
  Data data_;
  std::uint64_t known_ = 0;  ///< statements that were understood

  std::string name_;
  std::optional<std::uint32_t> material_;
  std::uint32_t smoothing_ = 0;  ///< 0: off
  std::optional<std::size_t> part_index_;

  std::map<std::pair<std::string, std::uint32_t>, std::size_t> parts_;
  std::map<std::string, std::uint32_t> materials_;
  std::set<std::string> libraries_;

  std::vector<Corner> face_;
  std::vector<Vec3> face_positions_;
  Triangulator triangulator_;
};

}  // namespace

Data parse(const std::filesystem::path& path, Notes& notes) { return Parser(path, notes).run(); }

}  // namespace lightcuts::obj
