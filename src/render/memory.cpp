#include "render/memory.h"

#include <sys/resource.h>

#include <fstream>
#include <string>

namespace lightcuts {

std::uint64_t peak_memory_bytes() {
  // The kernel's own count for this program; what getrusage says includes the peak of the program that started it.
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) return std::stoull(line.substr(6)) * 1024;
  }
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) != 0) return 0;
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

std::uint64_t default_memory_budget() {
  std::ifstream file("/proc/meminfo");
  std::string name, unit;
  for (std::uint64_t kibibytes = 0; file >> name >> kibibytes; std::getline(file, unit)) {
    if (name == "MemAvailable:") return kibibytes * 1024 / 4 * 3;
  }
  return 0;
}

}  // namespace lightcuts
