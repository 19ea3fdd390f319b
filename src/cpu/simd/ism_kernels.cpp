#include "cpu/simd/ism_kernels.h"

#include "cpu/simd/isa.h"

namespace lightcuts {

namespace isa_baseline {
extern const IsmKernels ism_kernels;
}
#if defined(__x86_64__)
namespace isa_sse42 {
extern const IsmKernels ism_kernels;
}
namespace isa_avx2 {
extern const IsmKernels ism_kernels;
}
namespace isa_avx512 {
extern const IsmKernels ism_kernels;
}
#endif

const IsmKernels& ism_kernels(Isa isa) {
  switch (isa) {
#if defined(__x86_64__)
    case Isa::sse42:
      return isa_sse42::ism_kernels;
    case Isa::avx2:
      return isa_avx2::ism_kernels;
    case Isa::avx512:
      return isa_avx512::ism_kernels;
#endif
    default:
      return isa_baseline::ism_kernels;
  }
}

}  // namespace lightcuts
