#define LC_ISA isa_baseline
#include "cpu/simd/ism_kernels_body.h"
