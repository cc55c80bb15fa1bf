#include "runtime/src/field_kernel.hpp"

#if defined(__x86_64__) && !defined(PALPATE_SCALAR_ONLY)
#include <immintrin.h>
#define PALPATE_X86 1
#endif

namespace palpate {
namespace {

void add_columns_scalar(const float* columns, size_t stride, const float* weights, uint32_t count,
                        float* sum) {
  for (uint32_t j = 0; j < count; ++j) {
    const float* column = columns + j * stride;
    const float weight = weights[j];
    for (uint32_t i = 0; i < pack::kPanelRows; ++i) sum[i] += weight * column[i];
  }
}

#ifdef PALPATE_X86

// 96 rows are 12 registers of 8 floats: enough independent sums to hide the latency of a fused multiply-add
// (4 cycles, 2 a cycle), and few enough that none spills; but only where the loops over them are unrolled,
// which GCC does not find out by itself: an array that is indexed lives in memory.
__attribute__((target("avx2,fma"))) void add_columns_avx2(const float* columns, size_t stride,
                                                          const float* weights, uint32_t count, float* sum) {
  constexpr uint32_t kRegisters = pack::kPanelRows / 8;
  __m256 sums[kRegisters];
#pragma GCC unroll 12
  for (uint32_t r = 0; r < kRegisters; ++r) sums[r] = _mm256_loadu_ps(sum + 8 * r);
  for (uint32_t j = 0; j < count; ++j) {
    const float* column = columns + j * stride;
    const __m256 weight = _mm256_broadcast_ss(weights + j);
#pragma GCC unroll 12
    for (uint32_t r = 0; r < kRegisters; ++r) {
      sums[r] = _mm256_fmadd_ps(weight, _mm256_load_ps(column + 8 * r), sums[r]);
    }
  }
#pragma GCC unroll 12
  for (uint32_t r = 0; r < kRegisters; ++r) _mm256_storeu_ps(sum + 8 * r, sums[r]);
}

// The same with six registers of 16 floats.
__attribute__((target("avx512f"))) void add_columns_avx512(const float* columns, size_t stride,
                                                           const float* weights, uint32_t count, float* sum) {
  constexpr uint32_t kRegisters = pack::kPanelRows / 16;
  __m512 sums[kRegisters];
#pragma GCC unroll 12
  for (uint32_t r = 0; r < kRegisters; ++r) sums[r] = _mm512_loadu_ps(sum + 16 * r);
  for (uint32_t j = 0; j < count; ++j) {
    const float* column = columns + j * stride;
    const __m512 weight = _mm512_set1_ps(weights[j]);
#pragma GCC unroll 12
    for (uint32_t r = 0; r < kRegisters; ++r) {
      sums[r] = _mm512_fmadd_ps(weight, _mm512_load_ps(column + 16 * r), sums[r]);
    }
  }
#pragma GCC unroll 12
  for (uint32_t r = 0; r < kRegisters; ++r) _mm512_storeu_ps(sum + 16 * r, sums[r]);
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
