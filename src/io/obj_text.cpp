#include "io/obj_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>

#include "lightcuts/error.h"

namespace lightcuts::obj {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBufferSize = std::size_t{1} << 20;
constexpr std::size_t kMaxLineLength = std::size_t{1} << 26;
constexpr std::string_view kSpaces{" \t\v\f\0", 5};

std::unique_ptr<std::FILE, int (*)(std::FILE*)> open_regular(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) {
    throw Error(Code::file_missing, fmt::format("{}: there is no such file. Check the name.", path.string()));
  }
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (file == nullptr) {
    throw Error(Code::file_missing,
                fmt::format("{}: the file cannot be opened. Check its permissions.", path.string()));
  }
  return file;
}

bool is_line_end(char c) { return c == '\n' || c == '\r'; }

}  // namespace

LineReader::LineReader(const fs::path& path) : path_(path), file_(open_regular(path)), buffer_(kBufferSize) {}

bool LineReader::refill() {
  std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  if (end_ == buffer_.size()) {
    if (buffer_.size() >= kMaxLineLength) {
      throw Error(Code::malformed,
                  fmt::format("{}, line {}: the line has more than {} MiB; this is no OBJ or MTL text.", path_.string(),
                              line_ + 1, kMaxLineLength >> 20));
    }
    buffer_.resize(2 * buffer_.size());
  }
  const std::size_t count = std::fread(buffer_.data() + end_, 1, buffer_.size() - end_, file_.get());
  end_ += count;
  return count > 0;
}

std::optional<std::string_view> LineReader::next_raw() {
  std::size_t searched = 0;  // bytes from begin_ on that hold no line end
  for (;;) {
    if (skip_line_feed_ && begin_ < end_) {
      if (buffer_[begin_] == '\n') ++begin_;
      skip_line_feed_ = false;
    }
    const char* const first = buffer_.data() + begin_;
    const char* const last = buffer_.data() + end_;
    const char* const found = std::find_if(first + std::min(searched, end_ - begin_), last, is_line_end);
    if (found != last) {
      begin_ = static_cast<std::size_t>(found - buffer_.data()) + 1;
      skip_line_feed_ = *found == '\r';
      ++line_;
      return std::string_view(first, static_cast<std::size_t>(found - first));
    }
    searched = end_ - begin_;
    if (refill()) continue;
    if (begin_ == end_) return {};
    const std::string_view rest(buffer_.data() + begin_, end_ - begin_);
    begin_ = end_;
    ++line_;
    return rest;
  }
}

std::optional<std::string_view> LineReader::next() {
  std::optional<std::string_view> line = next_raw();
  if (!line || !line->ends_with('\\')) return line;
  joined_.clear();
  for (; line; line = next_raw()) {
    const bool goes_on = line->ends_with('\\');
    joined_.append(line->substr(0, line->size() - (goes_on ? 1 : 0)));
    if (!goes_on) break;
    joined_.push_back(' ');
    if (joined_.size() > kMaxLineLength) {
      throw Error(Code::malformed, fmt::format("{}, line {}: the joined line is too long.", path_.string(), line_));
    }
  }
  return joined_;
}

std::string_view Words::next() {
  const std::size_t begin = std::min(text_.find_first_not_of(kSpaces), text_.size());
  const std::size_t end = std::min(text_.find_first_of(kSpaces, begin), text_.size());
  const std::string_view word = text_.substr(begin, end - begin);
  text_.remove_prefix(end);
  return word;
}

std::string_view Words::rest() const {
  const std::size_t begin = text_.find_first_not_of(kSpaces);
  if (begin == std::string_view::npos) return {};
  return text_.substr(begin, text_.find_last_not_of(kSpaces) - begin + 1);
}

float to_float(std::string_view word) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  const char* first = word.data();
  const char* const last = first + word.size();
  if (first != last && *first == '+') ++first;
  double value = 0;
  const auto [end, error] = std::from_chars(first, last, value);
  if (end != last || error == std::errc::invalid_argument) return kNan;
  if (error == std::errc::result_out_of_range) {
    const bool tiny = word.find("e-") != std::string_view::npos || word.find("E-") != std::string_view::npos;
    return tiny ? 0.0f : kInf;
  }
  if (std::fabs(value) > static_cast<double>(std::numeric_limits<float>::max())) return value > 0 ? kInf : -kInf;
  return static_cast<float>(value);
}

void Notes::add(const std::string& what, std::uint64_t line) {
  // A hostile file could invent a new kind with every line.
  constexpr std::size_t kMaxKinds = 100;
  const auto found = entries_.find(what);
  if (found != entries_.end()) {
    ++found->second.count;
  } else if (entries_.size() < kMaxKinds) {
    entries_[what] = {line, 1};
  }
}

void Notes::append_to(std::vector<std::string>& warnings) const {
  for (const auto& [what, entry] : entries_) {
    const std::string more = entry.count > 1 ? fmt::format(" ({} times in all)", entry.count) : "";
    warnings.push_back(fmt::format("{}, line {}: {}{}.", file_, entry.first_line, what, more));
  }
}

fs::path find_beside(const fs::path& folder, std::string_view name) {
  std::string separated(name);
  std::replace(separated.begin(), separated.end(), '\\', '/');
  if (separated.empty() || separated.find('\0') != std::string::npos) return {};
  std::error_code error;
  const auto usable = [&](const fs::path& path) { return fs::is_regular_file(path, error); };
  const fs::path relative = fs::path(separated).lexically_normal();
  const bool inside = relative.is_relative() && !relative.empty() && *relative.begin() != "..";
  if (inside && usable(folder / relative)) return folder / relative;
  const fs::path last = relative.filename();
  if (!inside && !last.empty() && last != ".." && usable(folder / last)) return folder / last;
  return {};
}

}  // namespace lightcuts::obj
