#include "runtime/src/field_kernel.hpp"

#if defined(__x86_64__) && !defined(PALPATE_SCALAR_ONLY)
#include <immintrin.h>
#define PALPATE_X86 1
#endif

namespace palpate {
namespace {

void add_columns_scalar(const pal_real* columns, size_t stride, const pal_real* weights, uint32_t count,
                        bool onto, pal_real* sum) {
  if (!onto) clear_panels(1, sum);
  for (uint32_t j = 0; j < count; ++j) {
    const pal_real* column = columns + j * stride;
    const pal_real weight = weights[j];
    for (uint32_t i = 0; i < pack::kPanelRows; ++i) sum[i] += weight * column[i];
  }
}

#ifdef PALPATE_X86

#if defined(PALPATE_FLOAT64) && PALPATE_FLOAT64
#define PALPATE_256(operation) _mm256_##operation##_pd
#define PALPATE_512(operation) _mm512_##operation##_pd
using Lanes256 = __m256d;
using Lanes512 = __m512d;
#else
#define PALPATE_256(operation) _mm256_##operation##_ps
#define PALPATE_512(operation) _mm512_##operation##_ps
using Lanes256 = __m256;
using Lanes512 = __m512;
#endif

// 12 registers, all 96 rows as floats, half of them as doubles: enough independent sums to hide the latency of a fused
// multiply-add (4 cycles, 2 a cycle), and few enough that none spills; but only where the loops over them are
// unrolled, which GCC does not find out by itself: an array that is indexed lives in memory.
__attribute__((target("avx2,fma"))) void add_columns_avx2(const pal_real* columns, size_t stride,
                                                          const pal_real* weights, uint32_t count, bool onto,
                                                          pal_real* sum) {
  constexpr uint32_t kRegisters = 12;
  constexpr uint32_t kLanes = sizeof(Lanes256) / sizeof(pal_real);
  for (uint32_t first = 0; first < pack::kPanelRows; first += kRegisters * kLanes) {
    Lanes256 sums[kRegisters];
#pragma GCC unroll 12
    for (uint32_t r = 0; r < kRegisters; ++r)
      sums[r] = onto ? PALPATE_256(loadu)(sum + first + kLanes * r) : PALPATE_256(setzero)();
    for (uint32_t j = 0; j < count; ++j) {
      const pal_real* column = columns + j * stride + first;
      const Lanes256 weight = PALPATE_256(set1)(weights[j]);
#pragma GCC unroll 12
      for (uint32_t r = 0; r < kRegisters; ++r) {
        sums[r] = PALPATE_256(fmadd)(weight, PALPATE_256(load)(column + kLanes * r), sums[r]);
      }
    }
#pragma GCC unroll 12
    for (uint32_t r = 0; r < kRegisters; ++r) PALPATE_256(storeu)(sum + first + kLanes * r, sums[r]);
  }
}

// The same with registers twice as wide, half as many of them or all rows at once.
__attribute__((target("avx512f"))) void add_columns_avx512(const pal_real* columns, size_t stride,
                                                           const pal_real* weights, uint32_t count, bool onto,
                                                           pal_real* sum) {
  constexpr uint32_t kLanes = sizeof(Lanes512) / sizeof(pal_real);
  constexpr uint32_t kRegisters = pack::kPanelRows / kLanes;
  Lanes512 sums[kRegisters];
#pragma GCC unroll 12
  for (uint32_t r = 0; r < kRegisters; ++r)
    sums[r] = onto ? PALPATE_512(loadu)(sum + kLanes * r) : PALPATE_512(setzero)();
  for (uint32_t j = 0; j < count; ++j) {
    const pal_real* column = columns + j * stride;
    const Lanes512 weight = PALPATE_512(set1)(weights[j]);
#pragma GCC unroll 12
    for (uint32_t r = 0; r < kRegisters; ++r) {
      sums[r] = PALPATE_512(fmadd)(weight, PALPATE_512(load)(column + kLanes * r), sums[r]);
    }
  }
#pragma GCC unroll 12
  for (uint32_t r = 0; r < kRegisters; ++r) PALPATE_512(storeu)(sum + kLanes * r, sums[r]);
}
#endif

}  // namespace

uint32_t list_field_kernels(FieldKernel kernels[kMostFieldKernels]) {
  uint32_t count = 0;
  kernels[count++] = {"scalar", add_columns_scalar};
#ifdef PALPATE_X86
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
    kernels[count++] = {"avx2", add_columns_avx2};
  if (__builtin_cpu_supports("avx512f")) kernels[count++] = {"avx512", add_columns_avx512};
#endif
  return count;
}

AddColumns choose_add_columns() {
  FieldKernel kernels[kMostFieldKernels];
  const uint32_t count = list_field_kernels(kernels);
  return kernels[count - 1].add_columns;
}

}  // namespace palpate
