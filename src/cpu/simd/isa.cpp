#include "cpu/simd/isa.h"

#include <algorithm>
#include <cstdlib>
#include <string>

#include "lightcuts/error.h"

namespace lightcuts {
namespace {

bool processor_runs(Isa isa) {
#if defined(__x86_64__)
  __builtin_cpu_init();
  switch (isa) {
    case Isa::baseline:
      return true;
    case Isa::sse42:
      return __builtin_cpu_supports("sse4.2");
    case Isa::avx2:
      return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    case Isa::avx512:
      return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512cd") &&
             __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") &&
             __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("fma");
  }
  return false;
#else
  return isa == Isa::baseline;
#endif
}

}  // namespace

std::string_view isa_name(Isa isa) {
  switch (isa) {
    case Isa::baseline:
      return "baseline";
    case Isa::sse42:
      return "sse4.2";
    case Isa::avx2:
      return "avx2";
    case Isa::avx512:
      return "avx512";
  }
  return "unknown";
}

std::vector<Isa> available_isas() {
  std::vector<Isa> available;
  for (const Isa isa : {Isa::baseline, Isa::sse42, Isa::avx2, Isa::avx512}) {
    if (processor_runs(isa)) available.push_back(isa);
  }
  return available;
}

Isa selected_isa() {
  const std::vector<Isa> available = available_isas();
  const char* wanted = std::getenv("LIGHTCUTS_ISA");
  if (wanted == nullptr || *wanted == '\0') return available.back();

  const auto found = std::find_if(available.begin(), available.end(), [&](Isa isa) { return isa_name(isa) == wanted; });
  if (found != available.end()) return *found;
  std::string names;
  for (const Isa isa : available) names += (names.empty() ? "" : ", ") + std::string(isa_name(isa));
  throw Error(Code::invalid_argument, "the environment variable LIGHTCUTS_ISA is '" + std::string(wanted) +
                                          "', but this machine runs only: " + names +
                                          "; unset it or name one of these");
}

}  // namespace lightcuts
