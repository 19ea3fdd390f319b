#define LC_ISA isa_baseline
#include "cpu/cut/cut_kernels_body.h"
