#pragma once

#include <CLI/CLI.hpp>

#include <functional>
#include <string>
#include <vector>

namespace lightcuts::app {

/// What runs once the command line has been read; returns the exit status. Set by the subcommand that was named.
using Action = std::function<int()>;

// Each adds one subcommand with its options and, when it is the one that was named, sets `action`.
// `words` is the whole command line, for messages that propose a better one.
void add_render_command(CLI::App& program, const std::vector<std::string>& words, Action& action);
void add_compare_command(CLI::App& program, Action& action);
void add_info_command(CLI::App& program, Action& action);
void add_scenes_command(CLI::App& program, Action& action);
void add_export_command(CLI::App& program, Action& action);
void add_bench_command(CLI::App& program, Action& action);

/// Several lines: version, commit, backends, instruction sets.
std::string version_text();

}  // namespace lightcuts::app
