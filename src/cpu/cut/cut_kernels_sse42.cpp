#define LC_ISA isa_sse42
#include "cpu/cut/cut_kernels_body.h"
