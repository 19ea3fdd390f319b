#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <string>
#include <thread>

#include "backend/backend.h"
#include "bench.h"
#include "lightcuts/error.h"
#include "lightcuts/version.h"
#include "render/make_backend.h"

namespace lightcuts::app {
namespace {

/// What follows "name :" in a file of lines such as /proc/cpuinfo; empty if nothing does.
std::string value_in(const char* file, const std::string& name) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with(name)) continue;
    const std::size_t at = line.find_first_not_of(" \t", line.find(':') + 1);
    return at == std::string::npos ? "" : line.substr(at);
  }
  return "";
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  return fmt::format("{:04}-{:02}-{:02}", parts.tm_year + 1900, parts.tm_mon + 1, parts.tm_mday);
}

double load_average() {
  std::array<double, 1> load{};
  return getloadavg(load.data(), 1) == 1 ? load[0] : 0;
}

}  // namespace

std::unique_ptr<Backend> make_bench_backend(const BenchRequest& request) {
  RenderOptions options;
  options.backend = request.backend == BackendKind::automatic ? BackendKind::cpu : request.backend;
  options.device = request.device;
  options.threads = request.threads;
  if (request.backend == BackendKind::automatic && built_with_cuda()) {
    try {
      options.backend = BackendKind::cuda;
      return make_backend(options);
    } catch (const Error& error) {
      if (error.code() != Code::no_device) throw;
      options.backend = BackendKind::cpu;
    }
  }
  return make_backend(options);
}

nlohmann::ordered_json machine_json(const std::string& device) {
  const std::string memory = value_in("/proc/meminfo", "MemTotal");
  return {{"version", version()},
          {"commit", commit()},
          {"date", today()},
          {"device", device},
          {"processor", value_in("/proc/cpuinfo", "model name")},
          {"cores", std::thread::hardware_concurrency()},
          {"memory_gib", std::strtod(memory.c_str(), nullptr) / (1024 * 1024)},
          {"load_at_start", load_average()}};
}

Repeats summarise(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return {(values[(n - 1) / 2] + values[n / 2]) / 2, values.front(), values.back(), static_cast<int>(n)};
}

}  // namespace lightcuts::app
