#include <CLI/CLI.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <exception>
#include <new>
#include <optional>
#include <string>
#include <vector>

#include "commands.h"
#include "console.h"
#include "exit_status.h"
#include "interruption.h"
#include "lightcuts/error.h"
#include "text.h"

namespace lightcuts::app {
namespace {

constexpr const char* kFooter = R"(
Start here:
  lightcuts render builtin:cornell        renders to cornell.exr and cornell.png
  lightcuts render --help                 all options, with examples
  lightcuts scenes                        scenes that need no file)";

/// The subcommand that was named, or the program itself.
CLI::App& named_command(CLI::App& program) {
  const auto named = program.get_subcommands();
  return named.empty() ? program : *named.front();
}

std::vector<std::string> option_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

std::vector<std::string> command_names(const CLI::App& program) {
  std::vector<std::string> names;
  for (const CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(command->get_name());
  }
  return names;
}

/// The parser's own message; where it counts values, in words that name the mistake.
std::string readable_problem(const CLI::ParseError& error) {
  std::string text = error.what();
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) == nullptr) return text;
  const std::string name = text.substr(0, text.find(':'));
  return text.find("received") == std::string::npos ? name + " needs a value" : name + " is given more than once";
}

/// What is wrong with a command line that the parser refused.
std::string usage_problem(CLI::App& program, const CLI::ParseError& error) {
  const CLI::App& command = named_command(program);
  const std::vector<std::string> unknown = program.remaining(true);
  const auto option = std::find_if(unknown.begin(), unknown.end(),
                                   [](const std::string& word) { return word.size() > 1 && word.front() == '-'; });
  if (option != unknown.end()) {
    const std::string name = option->substr(0, option->find('='));
    return fmt::format("there is no option '{}'{}", name, did_you_mean(name, option_names(command)));
  }
  if (unknown.empty()) return readable_problem(error);
  if (&command == &program) {
    return fmt::format("there is no command '{}'{}", unknown.front(),
                       did_you_mean(unknown.front(), command_names(program)));
  }
  return fmt::format("did not expect '{}' there", unknown.front());
}

int refuse_usage(CLI::App& program, const CLI::ParseError& error) {
  const CLI::App& command = named_command(program);
  const std::string name = &command == &program ? "lightcuts" : "lightcuts " + command.get_name();
  print_error(fmt::format("{}\n  see '{} --help'", usage_problem(program, error), name));
  return kWrongUsage;
}

/// Reads the command line and sets what is to be run; a status means that all is done already.
std::optional<int> parse(CLI::App& program, const std::vector<std::string>& words) {
  try {
    program.parse(std::vector<std::string>(words.rbegin(), words.rend() - 1));  // the parser takes the last one first
  } catch (const CLI::CallForHelp&) {
    print_result(program.help());
    return kDone;
  } catch (const CLI::CallForVersion&) {
    print_result(version_text());
    return kDone;
  } catch (const CLI::ParseError& error) {
    return refuse_usage(program, error);
  }
  return std::nullopt;
}

int run(const std::vector<std::string>& words) {
  CLI::App program(
      "Renders scenes lit by many lights: every lamp, sky and bounce of light becomes virtual point lights.",
      "lightcuts");
  program.footer(kFooter);
  program.get_formatter()->column_width(30);
  program.set_help_flag("-h,--help", "this text");
  program.set_version_flag("--version", version_text, "version, commit, backends, instruction sets");
  program.require_subcommand(0, 1);
  Action action;
  add_render_command(program, words, action);
  add_compare_command(program, action);
  add_info_command(program, action);
  add_scenes_command(program, action);
  add_export_command(program, action);
  add_bench_command(program, action);
  if (const auto status = parse(program, words)) return *status;
  if (action) return action();
  const std::string help = program.help();
  std::fwrite(help.data(), 1, help.size(), stderr);
  return kWrongUsage;
}

/// Runs, and turns everything that can be thrown into a message and a status.
int run_and_report(const std::vector<std::string>& words) {
  try {
    return run(words);
  } catch (const Error& error) {
    print_error(error.what());
    return exit_status(error.code());
  } catch (const std::bad_alloc&) {
    print_error("not enough memory; try a smaller --size, fewer --vpls, or a machine with more");
    return kNoRoom;
  } catch (const std::exception& error) {
    print_error(
        fmt::format("{}\n  this is a mistake in lightcuts; please report it with your command line", error.what()));
    return kInternal;
  }
}

}  // namespace
}  // namespace lightcuts::app

int main(int argc, char** argv) {
  using namespace lightcuts::app;
  end_on_signals();
  std::signal(SIGXFSZ, SIG_IGN);  // past a file-size limit write() then says so, and the message names the file
  const int status = run_and_report(std::vector<std::string>(argv, argv + argc));
  if (std::fflush(stdout) == 0) return status;
  print_error("standard output cannot be written");
  return status == kDone ? kNoRoom : status;
}
