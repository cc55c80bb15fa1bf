#include "runtime/src/field_kernel.hpp"

#if defined(__x86_64__) && !defined(PALPATE_SCALAR_ONLY)
#include <immintrin.h>
#define PALPATE_X86 1
#endif

namespace palpate {

void add_columns_scalar(const float* columns, size_t stride, const float* weights, uint32_t count,
                        float* sum) {
  for (uint32_t j = 0; j < count; ++j) {
    const float* column = columns + j * stride;
    const float weight = weights[j];
    for (uint32_t i = 0; i < pack::kPanelRows; ++i) sum[i] += weight * column[i];
  }
}

#ifdef PALPATE_X86
namespace {

// 96 rows are 12 registers of 8 floats: enough independent sums to hide the latency of a fused multiply-add
// (4 cycles, 2 a cycle), and few enough that none spills.
__attribute__((target("avx2,fma"))) void add_columns_avx2(const float* columns, size_t stride,
                                                          const float* weights, uint32_t count, float* sum) {
  constexpr uint32_t kRegisters = pack::kPanelRows / 8;
  __m256 sums[kRegisters];
  for (uint32_t r = 0; r < kRegisters; ++r) sums[r] = _mm256_loadu_ps(sum + 8 * r);
  for (uint32_t j = 0; j < count; ++j) {
    const float* column = columns + j * stride;
    const __m256 weight = _mm256_broadcast_ss(weights + j);
    for (uint32_t r = 0; r < kRegisters; ++r) {
      sums[r] = _mm256_fmadd_ps(weight, _mm256_load_ps(column + 8 * r), sums[r]);
    }
  }
  for (uint32_t r = 0; r < kRegisters; ++r) _mm256_storeu_ps(sum + 8 * r, sums[r]);
}

}  // namespace

AddColumns choose_add_columns() {
  __builtin_cpu_init();
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? add_columns_avx2
                                                                         : add_columns_scalar;
}
#else
AddColumns choose_add_columns() {
  return add_columns_scalar;
}
#endif

}  // namespace palpate
