#pragma once

#include <string_view>
#include <vector>

namespace lightcuts {

/// Instruction sets that the SIMD kernels are compiled for, the poorest first.
enum class Isa { baseline, sse42, avx2, avx512 };

/// "baseline", "sse4.2", "avx2" or "avx512": what LIGHTCUTS_ISA takes and `--version` prints.
std::string_view isa_name(Isa isa);

/// What this build has and this processor runs, the poorest first.
std::vector<Isa> available_isas();

/// The best available instruction set, or the one that the environment variable LIGHTCUTS_ISA names.
/// Throws Error{invalid_argument} if that is no name of one, or one that this machine does not run.
Isa selected_isa();

}  // namespace lightcuts
