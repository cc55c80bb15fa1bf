#include "runtime/src/numerics/field_kernel.hpp"

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

void add_rounded_scalar(const int16_t* columns, const RoundedWeights& rounded, bool onto, pal_real* sum) {
  constexpr uint32_t kRows = pack::kPanelRows;
  if (!onto) clear_panels(1, sum);
  int32_t integers[kRows] = {};
  const int16_t* weight = rounded.weights;
  const auto flush = [&](pal_real unit) {
    for (uint32_t i = 0; i < kRows; ++i) {
      sum[i] += unit * static_cast<pal_real>(integers[i]);
      integers[i] = 0;
    }
  };
  for (uint32_t p = 0; p <= rounded.num_pairs; ++p, weight += 2) {
    for (uint32_t i = 0; i < kRows; ++i, columns += 2)
      integers[i] += weight[0] * columns[0] + weight[1] * columns[1];
    if (p > 0) continue;
    for (uint32_t i = 0; i < kRows; ++i) integers[i] += weight[2] * *columns++;
    flush(rounded.first_unit);
    ++weight;
  }
  if (rounded.num_pairs > 0) flush(rounded.unit);
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

// 12 registers hold 96 floats, or half of 96 doubles. 12 independent sums hide the latency of a fused
// multiply-add without spilling registers. Without explicit unrolling, GCC keeps an indexed array in memory.
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

#if !(defined(PALPATE_FLOAT64) && PALPATE_FLOAT64)
// Returns both weights of a pair in one integer.
int pair_of(const int16_t* weights) {
  int pair;
  memcpy(&pair, weights, sizeof pair);
  return pair;
}

// Returns the weight of a single column, paired with 0. A widened entry is a pair of entry and sign bits.
int single_of(const int16_t* weight) {
  return static_cast<uint16_t>(*weight);
}

// Sums num_pairs pairs of columns, and a single column if `single`, in 12 registers of 8 rows.
__attribute__((target("avx2,fma"))) void add_part_avx2(const int16_t* columns, const int16_t* weights,
                                                       uint32_t num_pairs, bool single, pal_real unit,
                                                       bool onto, pal_real* sum) {
  constexpr uint32_t kRegisters = 12;
  constexpr uint32_t kLanes = 8;
  __m256i integers[kRegisters];
#pragma GCC unroll 12
  for (uint32_t r = 0; r < kRegisters; ++r) integers[r] = _mm256_setzero_si256();
  for (uint32_t p = 0; p < num_pairs; ++p, columns += 2 * pack::kPanelRows, weights += 2) {
    const __m256i weight = _mm256_set1_epi32(pair_of(weights));
#pragma GCC unroll 12
    for (uint32_t r = 0; r < kRegisters; ++r) {
      const __m256i pair = _mm256_load_si256(reinterpret_cast<const __m256i*>(columns + 2 * kLanes * r));
      integers[r] = _mm256_add_epi32(integers[r], _mm256_madd_epi16(pair, weight));
    }
  }
  if (single) {
    const __m256i weight = _mm256_set1_epi32(single_of(weights));
#pragma GCC unroll 12
    for (uint32_t r = 0; r < kRegisters; ++r) {
      const __m128i entries = _mm_load_si128(reinterpret_cast<const __m128i*>(columns + kLanes * r));
      integers[r] = _mm256_add_epi32(integers[r], _mm256_madd_epi16(_mm256_cvtepi16_epi32(entries), weight));
    }
  }
  __m256i stored[kRegisters];
#pragma GCC unroll 12
  for (uint32_t r = 0; r < kRegisters; ++r) _mm256_store_si256(stored + r, integers[r]);
#pragma GCC unroll 1
  for (uint32_t r = 0; r < kRegisters; ++r) {
    const __m256 rows = onto ? _mm256_loadu_ps(sum + kLanes * r) : _mm256_setzero_ps();
    const __m256 added = _mm256_cvtepi32_ps(_mm256_load_si256(stored + r));
    _mm256_storeu_ps(sum + kLanes * r, _mm256_fmadd_ps(_mm256_set1_ps(unit), added, rows));
  }
}

void add_rounded_avx2(const int16_t* columns, const RoundedWeights& rounded, bool onto, pal_real* sum) {
  add_part_avx2(columns, rounded.weights, 1, true, rounded.first_unit, onto, sum);
  if (rounded.num_pairs > 0)
    add_part_avx2(columns + size_t{3} * pack::kPanelRows, rounded.weights + 3, rounded.num_pairs, false,
                  rounded.unit, true, sum);
}

// Keeps 6 registers of 16 sums. The full masks avoid GCC's warning about unmasked conversions.
__attribute__((target("avx512f,avx512vnni"))) void add_rounded_avx512vnni(const int16_t* columns,
                                                                          const RoundedWeights& rounded,
                                                                          bool onto, pal_real* sum) {
  constexpr uint32_t kRegisters = 6;
  constexpr uint32_t kLanes = 16;
  __m512 rows[kRegisters];
#pragma GCC unroll 6
  for (uint32_t r = 0; r < kRegisters; ++r)
    rows[r] = onto ? _mm512_loadu_ps(sum + kLanes * r) : _mm512_setzero_ps();
  const int16_t* weights = rounded.weights;
  const uint32_t num_parts = rounded.num_pairs > 0 ? 2 : 1;
#pragma GCC unroll 1
  for (uint32_t part = 0; part < num_parts; ++part) {
    __m512i integers[kRegisters];
#pragma GCC unroll 6
    for (uint32_t r = 0; r < kRegisters; ++r) integers[r] = _mm512_setzero_si512();
    const uint32_t num_pairs = part == 0 ? 1 : rounded.num_pairs;
    for (uint32_t p = 0; p < num_pairs; ++p, columns += 2 * pack::kPanelRows, weights += 2) {
      const __m512i weight = _mm512_set1_epi32(pair_of(weights));
#pragma GCC unroll 6
      for (uint32_t r = 0; r < kRegisters; ++r) {
        integers[r] = _mm512_dpwssd_epi32(integers[r], _mm512_load_si512(columns + 2 * kLanes * r), weight);
      }
    }
    if (part == 0) {
      const __m512i weight = _mm512_set1_epi32(single_of(weights++));
#pragma GCC unroll 6
      for (uint32_t r = 0; r < kRegisters; ++r, columns += kLanes) {
        const __m256i entries = _mm256_load_si256(reinterpret_cast<const __m256i*>(columns));
        integers[r] = _mm512_dpwssd_epi32(integers[r], _mm512_maskz_cvtepi16_epi32(0xffff, entries), weight);
      }
    }
    const __m512 unit = _mm512_set1_ps(part == 0 ? rounded.first_unit : rounded.unit);
#pragma GCC unroll 6
    for (uint32_t r = 0; r < kRegisters; ++r)
      rows[r] = _mm512_fmadd_ps(unit, _mm512_maskz_cvtepi32_ps(0xffff, integers[r]), rows[r]);
  }
#pragma GCC unroll 6
  for (uint32_t r = 0; r < kRegisters; ++r) _mm512_storeu_ps(sum + kLanes * r, rows[r]);
}
#else
constexpr AddRounded add_rounded_avx2 = add_rounded_scalar;
#endif

// As add_columns_avx2, with registers of twice the width.
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
  kernels[count++] = {"scalar", add_columns_scalar, add_rounded_scalar};
#ifdef PALPATE_X86
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    kernels[count++] = {"avx2", add_columns_avx2, add_rounded_avx2};
    if (__builtin_cpu_supports("avx512f"))
      kernels[count++] = {"avx512", add_columns_avx512, add_rounded_avx2};
#if !(defined(PALPATE_FLOAT64) && PALPATE_FLOAT64)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vnni"))
      kernels[count++] = {"avx512vnni", add_columns_avx512, add_rounded_avx512vnni};
#endif
  }
#endif
  return count;
}

FieldKernel choose_field_kernel() {
  FieldKernel kernels[kMostFieldKernels];
  const uint32_t count = list_field_kernels(kernels);
  return kernels[count - 1];
}

}  // namespace palpate
