#pragma once

#include "cpu/simd/isa.h"

namespace lightcuts::bench {

/// Runs a loop of nothing but independent multiply-adds in the widest registers of an instruction set (multiplications
/// and additions in turn where it has no fused ones). Returns the floating-point operations done.
double run_fma_loop(Isa isa, long rounds);

}  // namespace lightcuts::bench
