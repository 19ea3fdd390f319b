#include "cpu/simd/shade_kernels.h"

#include "cpu/simd/isa.h"

namespace lightcuts {

namespace isa_baseline {
extern const ShadeKernels kernels;
}
#if defined(__x86_64__)
namespace isa_sse42 {
extern const ShadeKernels kernels;
}
namespace isa_avx2 {
extern const ShadeKernels kernels;
}
namespace isa_avx512 {
extern const ShadeKernels kernels;
}
#endif

const ShadeKernels& shade_kernels(Isa isa) {
  switch (isa) {
#if defined(__x86_64__)
    case Isa::sse42:
      return isa_sse42::kernels;
    case Isa::avx2:
      return isa_avx2::kernels;
    case Isa::avx512:
      return isa_avx512::kernels;
#endif
    default:
      return isa_baseline::kernels;
  }
}

}  // namespace lightcuts
