#pragma once

#include <string>
#include <utility>
#include <vector>

#include "support/program.h"

namespace lightcuts::test {

/// The words of a call of the program under test.
inline std::vector<std::string> lightcuts_words(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), LC_COMMAND);
  return arguments;
}

inline ProgramResult run_lightcuts(std::vector<std::string> arguments, const ProgramOptions& options = {}) {
  return run_program(lightcuts_words(std::move(arguments)), options);
}

}  // namespace lightcuts::test
