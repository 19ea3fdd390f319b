#define LC_ISA isa_avx2
#include "cpu/simd/ism_kernels_body.h"
