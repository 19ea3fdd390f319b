#define LC_ISA isa_avx512
#include "cpu/cut/cut_kernels_body.h"
