#pragma once

#include <CLI/CLI.hpp>

#include <functional>
#include <string>

#include "lightcuts/error.h"

namespace lightcuts::app {

/// Adds an option whose text is read by `read`; what `read` throws as Error becomes the parser's message.
/// `value` names the value in the help. One value each time; twice is refused.
template <class Read>
CLI::Option* add_value(CLI::App& command, const std::string& names, const std::string& value, Read read,
                       const std::string& help) {
  const std::string shown = names.substr(names.rfind(',') + 1);
  CLI::callback_t callback = [shown, read](const CLI::results_t& texts) {
    for (const std::string& text : texts) {
      try {
        read(text);
      } catch (const Error& error) {
        throw CLI::ValidationError(shown, error.what());
      }
    }
    return true;
  };
  return command.add_option(names, std::move(callback), help)->option_text(value);
}

/// The same for an option that may be given several times.
template <class Read>
CLI::Option* add_values(CLI::App& command, const std::string& names, const std::string& value, Read read,
                        const std::string& help) {
  return add_value(command, names, value, read, help)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

}  // namespace lightcuts::app
