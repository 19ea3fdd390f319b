#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lightcuts::obj {

/// Reads a text file line by line through a small buffer; lines end in LF, CR LF or CR, and a backslash before the end
/// joins the next one.
class LineReader {
 public:
  /// Throws Error{file_missing} if it cannot be opened or is no regular file.
  explicit LineReader(const std::filesystem::path& path);

  /// The next line without its end, valid until the next call; nothing at the end of the file.
  /// Throws Error{malformed} for a line of absurd length.
  std::optional<std::string_view> next();

  /// Number of the line that next() gave last, from 1; the last one of a joined line.
  [[nodiscard]] std::uint64_t line() const { return line_; }

 private:
  std::optional<std::string_view> next_raw();
  bool refill();

  std::filesystem::path path_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0, end_ = 0;
  bool skip_line_feed_ = false;  ///< the last line ended in CR at the end of the buffer
  std::string joined_;
  std::uint64_t line_ = 0;
};

/// The rest of a line, taken word by word. Zero bytes count as spaces.
class Words {
 public:
  explicit Words(std::string_view text) : text_(text) {}
  /// The next word, empty at the end.
  std::string_view next();
  /// All that is left, without spaces around it.
  [[nodiscard]] std::string_view rest() const;

 private:
  std::string_view text_;
};

/// The number that a word is: NaN if it is none, infinite or zero where a float cannot hold it.
float to_float(std::string_view word);

/// Things worth a warning, each kind told once with how often and where first.
class Notes {
 public:
  explicit Notes(std::string file) : file_(std::move(file)) {}
  void add(const std::string& what, std::uint64_t line);
  /// "scene.obj, line 12: WHAT (and 3 more)" for each kind, in alphabetical order.
  void append_to(std::vector<std::string>& warnings) const;

 private:
  struct Entry {
    std::uint64_t first_line = 0, count = 0;
  };
  std::string file_;
  std::map<std::string, Entry> entries_;
};

/// The file below `folder` that a name in another file means: backslashes are separators. A name that leaves the folder
/// is looked for by its last part inside it, so that a foreign file cannot make us read /etc. Empty if there is none.
std::filesystem::path find_beside(const std::filesystem::path& folder, std::string_view name);

}  // namespace lightcuts::obj
