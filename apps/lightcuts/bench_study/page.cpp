#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string>

#include "bench_study/study.h"
#include "console.h"
#include "text.h"

namespace lightcuts::app::study {
namespace {

constexpr const char* kScript = "study_report";  // a folder that Python runs

/// The script beside the program: in a build folder, in an installation or a bundle, or nowhere.
std::filesystem::path find_script() {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) return {};
  const std::filesystem::path folder = program.parent_path();
  for (const char* where : {"../share/lightcuts", "share/lightcuts", "."}) {
    std::filesystem::path script = folder / where / kScript;
    if (std::filesystem::exists(script / "__main__.py")) return script;
  }
  return {};
}

/// Debian's own interpreter first: it is the one that Debian's matplotlib belongs to.
int run_python(const std::string& script, const std::string& folder) {
  for (const char* interpreter : {"/usr/bin/python3", "python3"}) {
    std::array<std::string, 3> words{interpreter, script, folder};
    std::array<char*, 4> arguments{words[0].data(), words[1].data(), words[2].data(), nullptr};
    pid_t child = 0;
    if (posix_spawnp(&child, interpreter, nullptr, nullptr, arguments.data(), environ) != 0) continue;
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    if (code != 127) return code;
  }
  return 127;
}

}  // namespace

bool make_page(const std::filesystem::path& folder) {
  const std::filesystem::path script = find_script();
  const std::string tables = "the tables are in " + shell_quoted((folder / "tables").string());
  if (script.empty()) {
    print_note("no plots and no page, for the script " + std::string(kScript) + " is not beside this program; " +
               tables);
    return false;
  }
  const int status = run_python(script.string(), folder.string());
  if (status == 0) {
    print_result("The page is " + shell_quoted((folder / "index.html").string()));
    return true;
  }
  print_note(status == 127 ? "no plots and no page, for there is no Python 3; " + tables
             : status == 3
                 ? "no plots and no page, for Python has no matplotlib (Debian: python3-matplotlib); " + tables
                 : "no page: " + script.string() + " failed; " + tables);
  return false;
}

}  // namespace lightcuts::app::study
