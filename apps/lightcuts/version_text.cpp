#include <fmt/format.h>

#include <string>

#include "commands.h"
#include "lightcuts/version.h"

namespace lightcuts::app {
namespace {

/// Those that the program has code for and this processor can run.
std::string instruction_sets() {
#if defined(__x86_64__)
  std::string out;
  const auto add = [&](bool present, const char* name) {
    if (present) out += (out.empty() ? "" : ", ") + std::string(name);
  };
  add(__builtin_cpu_supports("sse4.2"), "SSE4.2");
  add(__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"), "AVX2");
  add(__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq"), "AVX-512");
  return out.empty() ? "baseline" : out;
#else
  return "baseline";
#endif
}

}  // namespace

std::string version_text() {
  return fmt::format("lightcuts {}\ncommit {}\nbackends: cpu{}\ninstruction sets of this processor: {}", version(),
                     commit(), built_with_cuda() ? ", cuda" : " (built without cuda)", instruction_sets());
}

}  // namespace lightcuts::app
