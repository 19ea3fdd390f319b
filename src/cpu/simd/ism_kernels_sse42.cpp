#define LC_ISA isa_sse42
#include "cpu/simd/ism_kernels_body.h"
