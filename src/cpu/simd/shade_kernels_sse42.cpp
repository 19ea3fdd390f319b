#define LC_ISA isa_sse42
#define LC_ISA_NAME "sse4.2"
#include "cpu/simd/shade_kernels_body.h"
