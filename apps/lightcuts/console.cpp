#include "console.h"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>

namespace lightcuts::app {
namespace {

bool stdout_is_for_content = false;

void print(const char* kind, const char* colour, const std::string& message) {
  const bool coloured = stderr_has_colours();
  const std::string line =
      (coloured ? colour : "") + std::string(kind) + (coloured ? "\033[0m" : "") + ": " + message + "\n";
  std::fwrite(line.data(), 1, line.size(), stderr);
}

}  // namespace

bool stderr_has_colours() {
  const char* no_color = std::getenv("NO_COLOR");
  return isatty(STDERR_FILENO) != 0 && (no_color == nullptr || *no_color == '\0');
}

void print_error(const std::string& message) { print("error", "\033[1;31m", message); }
void print_warning(const std::string& message) { print("warning", "\033[1;33m", message); }
void print_note(const std::string& message) { print("note", "\033[1;36m", message); }

void print_result(const std::string& line) {
  std::FILE* stream = stdout_is_for_content ? stderr : stdout;
  std::fwrite(line.data(), 1, line.size(), stream);
  std::fputc('\n', stream);
}

void keep_stdout_for_content() { stdout_is_for_content = true; }
void print_content(const std::string& text) { std::fwrite(text.data(), 1, text.size(), stdout); }

}  // namespace lightcuts::app
