#include "support/program.h"

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <stdexcept>

namespace lightcuts::test {
namespace {

struct Ends {
  int read_end = -1, write_end = -1;
};

Ends make_pipe() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  return {ends[0], ends[1]};
}

Ends make_terminal() {
  winsize size{};
  size.ws_row = 25;
  size.ws_col = 80;
  Ends ends;
  if (openpty(&ends.read_end, &ends.write_end, nullptr, nullptr, &size) != 0) {
    throw std::runtime_error("this system lends no terminal");
  }
  fcntl(ends.read_end, F_SETFD, FD_CLOEXEC);
  fcntl(ends.write_end, F_SETFD, FD_CLOEXEC);
  return ends;
}

[[noreturn]] void become(const std::vector<std::string>& words, const ProgramOptions& options, int out, int err) {
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) signal(number, SIG_DFL);  // whatever the tests were started with
  if (options.in_background) signal(SIGINT, SIG_IGN);
  dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  if (!options.folder.empty() && chdir(options.folder.c_str()) != 0) _exit(126);
  for (const auto& [name, value] : options.environment) setenv(name.c_str(), value.c_str(), 1);
  if (options.largest_file > 0) {
    const rlimit limit{options.largest_file, options.largest_file};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  execv(arguments[0], arguments.data());
  _exit(127);
}

/// Appends what is there; closes at the end. A terminal whose other side is gone reports an error instead of an end.
void drain(int& pipe, std::string& text) {
  std::array<char, 4096> buffer{};
  const ssize_t count = read(pipe, buffer.data(), buffer.size());
  if (count > 0) {
    text.append(buffer.data(), static_cast<std::size_t>(count));
  } else {
    close(pipe);
    pipe = -1;
  }
}

}  // namespace

bool lends_terminals() {
  Ends ends;
  if (openpty(&ends.read_end, &ends.write_end, nullptr, nullptr, nullptr) != 0) return false;
  close(ends.read_end);
  close(ends.write_end);
  return true;
}

Program::Program(const std::vector<std::string>& words, const ProgramOptions& options)
    : deadline_(std::chrono::steady_clock::now() + options.time_limit) {
  const Ends out = make_pipe();
  const Ends err = options.terminal ? make_terminal() : make_pipe();
  pid_ = fork();
  if (pid_ == 0) become(words, options, out.write_end, err.write_end);
  close(out.write_end);
  close(err.write_end);
  out_pipe_ = out.read_end;
  err_pipe_ = err.read_end;
}

Program::~Program() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  for (const int pipe : {out_pipe_, err_pipe_}) {
    if (pipe >= 0) close(pipe);
  }
}

void Program::send(int signal) const { kill(pid_, signal); }

bool Program::read_some() {
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline_ - std::chrono::steady_clock::now());
  if ((out_pipe_ < 0 && err_pipe_ < 0) || left.count() <= 0) return false;
  std::array<pollfd, 2> pipes{{{out_pipe_, POLLIN, 0}, {err_pipe_, POLLIN, 0}}};
  if (poll(pipes.data(), pipes.size(), static_cast<int>(left.count())) <= 0) return false;
  if (pipes[0].revents != 0) drain(out_pipe_, out_);
  if (pipes[1].revents != 0) drain(err_pipe_, err_);
  return true;
}

bool Program::wait_for_err(const std::string& text) {
  while (err_.find(text) == std::string::npos) {
    if (!read_some()) return false;
  }
  return true;
}

int Program::wait() {
  while (read_some()) {
  }
  if (std::chrono::steady_clock::now() >= deadline_) kill(pid_, SIGKILL);
  int status = 0;
  waitpid(pid_, &status, 0);
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

ProgramResult run_program(const std::vector<std::string>& words, const ProgramOptions& options) {
  Program program(words, options);
  const int status = program.wait();
  return {status, program.out(), program.err()};
}

TemporaryFolder::TemporaryFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "lightcuts-test-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::permissions(path_, std::filesystem::perms::owner_all, ignored);
  std::filesystem::remove_all(path_, ignored);
}

std::vector<std::string> TemporaryFolder::names() const {
  std::vector<std::string> found;
  for (const auto& entry : std::filesystem::directory_iterator(path_))
    found.push_back(entry.path().filename().string());
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace lightcuts::test
