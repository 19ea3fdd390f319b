#include "cpu/fma_loop.h"

namespace lightcuts::bench {
namespace {

#if defined(__x86_64__)
#define LC_REGISTER(a) "+v"(a)
#define LC_TARGET(options) __attribute__((target(options)))
#else
#define LC_REGISTER(a) "+w"(a)
#define LC_TARGET(options)
#endif

// NOLINTBEGIN(bugprone-macro-parentheses): attributes and asm operands take no parentheses.
// Ten chains hide the latency of two units of four cycles; the empty asm keeps the compiler from folding them.
#define LC_FMA_LOOP(name, bytes, target_options)                                                              \
  __attribute__((noinline)) target_options double name(long rounds) {                                         \
    typedef float Vector __attribute__((vector_size(bytes)));                                                 \
    const Vector m = Vector{} + 0.9999f, c = Vector{} + 1e-4f;                                                \
    Vector a0 = c, a1 = c, a2 = c, a3 = c, a4 = c, a5 = c, a6 = c, a7 = c, a8 = c, a9 = c;                    \
    for (long i = 0; i < rounds; ++i) {                                                                       \
      a0 = a0 * m + c, a1 = a1 * m + c, a2 = a2 * m + c, a3 = a3 * m + c, a4 = a4 * m + c;                    \
      a5 = a5 * m + c, a6 = a6 * m + c, a7 = a7 * m + c, a8 = a8 * m + c, a9 = a9 * m + c;                    \
      asm volatile("" : LC_REGISTER(a0), LC_REGISTER(a1), LC_REGISTER(a2), LC_REGISTER(a3), LC_REGISTER(a4)); \
      asm volatile("" : LC_REGISTER(a5), LC_REGISTER(a6), LC_REGISTER(a7), LC_REGISTER(a8), LC_REGISTER(a9)); \
    }                                                                                                         \
    constexpr int operations = 10 * 2 * ((bytes) / 4);                                                        \
    return static_cast<double>(rounds) * operations;                                                          \
  }
// NOLINTEND(bugprone-macro-parentheses)

LC_FMA_LOOP(loop_16, 16, )
#if defined(__x86_64__)
LC_FMA_LOOP(loop_32, 32, LC_TARGET("avx2,fma"))
LC_FMA_LOOP(loop_64, 64, LC_TARGET("avx512f"))
#endif

}  // namespace

double run_fma_loop(Isa isa, long rounds) {
#if defined(__x86_64__)
  if (isa == Isa::avx512) return loop_64(rounds);
  if (isa == Isa::avx2) return loop_32(rounds);
#endif
  (void)isa;
  return loop_16(rounds);
}

}  // namespace lightcuts::bench
