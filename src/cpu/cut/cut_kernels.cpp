#include "cpu/cut/cut_kernels.h"

#include "cpu/simd/isa.h"

namespace lightcuts {

namespace isa_baseline {
extern const CutKernels cut_kernels;
}
#if defined(__x86_64__)
namespace isa_sse42 {
extern const CutKernels cut_kernels;
}
namespace isa_avx2 {
extern const CutKernels cut_kernels;
}
namespace isa_avx512 {
extern const CutKernels cut_kernels;
}
#endif

const CutKernels& cut_kernels(Isa isa) {
  switch (isa) {
#if defined(__x86_64__)
    case Isa::sse42:
      return isa_sse42::cut_kernels;
    case Isa::avx2:
      return isa_avx2::cut_kernels;
    case Isa::avx512:
      return isa_avx512::cut_kernels;
#endif
    default:
      return isa_baseline::cut_kernels;
  }
}

}  // namespace lightcuts
