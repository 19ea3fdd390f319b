#define LC_ISA isa_avx512
#include "cpu/simd/ism_kernels_body.h"
