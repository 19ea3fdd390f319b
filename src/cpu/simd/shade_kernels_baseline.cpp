#define LC_ISA isa_baseline
#define LC_ISA_NAME "baseline"
#include "cpu/simd/shade_kernels_body.h"
