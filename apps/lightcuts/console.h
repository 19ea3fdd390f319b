#pragma once

#include <string>

namespace lightcuts::app {

/// True if colours may be used on stderr: a terminal, and the environment variable NO_COLOR is not set.
bool stderr_has_colours();

// One message each, on stderr, as whole lines that begin with what they are.
void print_error(const std::string& message);
void print_warning(const std::string& message);
void print_note(const std::string& message);

/// A result, on stdout.
void print_result(const std::string& line);

/// From now on results go to stderr: stdout is for one file's content.
void keep_stdout_for_content();
/// That content.
void print_content(const std::string& text);

}  // namespace lightcuts::app
