#define LC_ISA isa_avx2
#define LC_ISA_NAME "avx2"
#include "cpu/simd/shade_kernels_body.h"
