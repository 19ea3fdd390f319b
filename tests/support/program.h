#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <sys/types.h>

namespace lightcuts::test {

/// How a program is started.
struct ProgramOptions {
  std::filesystem::path folder;                    ///< its current folder; empty: ours
  std::map<std::string, std::string> environment;  ///< added to ours
  bool terminal = false;                           ///< stderr is a terminal of 80 columns
  bool in_background = false;                      ///< started with SIGINT ignored, as scripts start such jobs
  std::size_t largest_file = 0;                    ///< file-size limit [bytes], 0: none
  std::chrono::seconds time_limit{120};            ///< killed after that, status -1
};

/// Whether this system lends terminals: a bare root may have no /dev/pts.
bool lends_terminals();

/// A program that runs beside the test; ended, if need be, when this goes.
class Program {
 public:
  Program(const std::vector<std::string>& words, const ProgramOptions& options);
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void send(int signal) const;
  /// Reads until stderr holds `text`; false if the program ended before or the time is up.
  bool wait_for_err(const std::string& text);
  /// Reads until the program ends; its exit status, or minus the number of the signal that ended it.
  int wait();

  [[nodiscard]] const std::string& out() const { return out_; }
  [[nodiscard]] const std::string& err() const { return err_; }

 private:
  bool read_some();

  pid_t pid_ = -1;
  int out_pipe_ = -1, err_pipe_ = -1;
  std::string out_, err_;
  std::chrono::steady_clock::time_point deadline_;
};

struct ProgramResult {
  int status = 0;
  std::string out, err;
};

/// Runs a program to its end.
ProgramResult run_program(const std::vector<std::string>& words, const ProgramOptions& options = {});

/// An empty folder, gone with this object.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  /// Names of all that is in it, sorted.
  [[nodiscard]] std::vector<std::string> names() const;

 private:
  std::filesystem::path path_;
};

}  // namespace lightcuts::test
