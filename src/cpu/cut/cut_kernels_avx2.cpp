#define LC_ISA isa_avx2
#include "cpu/cut/cut_kernels_body.h"
