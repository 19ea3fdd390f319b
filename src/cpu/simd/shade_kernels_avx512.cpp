#define LC_ISA isa_avx512
#define LC_ISA_NAME "avx512"
#include "cpu/simd/shade_kernels_body.h"
