// The AVX2 kernel of elimination.hpp.
#include "runtime/src/numerics/elimination_block.hpp"

#ifdef PALPATE_X86

#include <immintrin.h>

namespace palpate {
namespace {

constexpr uint32_t kColumns = kEliminationColumns;
constexpr uint32_t kHalf = kEliminationRows / 2;

#define PALPATE_AVX2 __attribute__((target("avx2,fma")))
// Unrolled loops keep arrays of registers in registers.
#define PALPATE_UNROLL _Pragma("GCC unroll 4")

PALPATE_AVX2 inline __m256d load_four(const float* entries) {
  return _mm256_cvtps_pd(_mm_load_ps(entries));
}

// Loads a tile and subtracts the products of the columns before the tile, which is two vectors high. A third
// vector would hide more latency, but would waste half of the tile on padding in such small matrices.
PALPATE_AVX2 inline void subtract_avx2(const float* matrix, uint32_t stride, uint32_t row, uint32_t first,
                                       uint32_t columns, __m256 low[kColumns], __m256 high[kColumns]) {
  const float* target = matrix + size_t{first} * stride + row;
  PALPATE_UNROLL
  for (uint32_t c = 0; c < kColumns; ++c) {
    low[c] = _mm256_load_ps(target + c * stride);
    high[c] = _mm256_load_ps(target + c * stride + kHalf);
  }
  const float* rows = matrix + row;
  const float* factors = matrix + first;
  for (uint32_t k = 0; k < columns; ++k, rows += stride, factors += stride) {
    const __m256 a = _mm256_load_ps(rows);
    const __m256 b = _mm256_load_ps(rows + kHalf);
    PALPATE_UNROLL
    for (uint32_t c = 0; c < kColumns; ++c) {
      const __m256 factor = _mm256_broadcast_ss(factors + c);
      low[c] = _mm256_fnmadd_ps(a, factor, low[c]);
      high[c] = _mm256_fnmadd_ps(b, factor, high[c]);
    }
  }
}

PALPATE_AVX2 inline void store_avx2(const __m256 low[kColumns], const __m256 high[kColumns], uint32_t stride,
                                    float* target) {
  PALPATE_UNROLL
  for (uint32_t c = 0; c < kColumns; ++c) {
    _mm256_store_ps(target + c * stride, low[c]);
    _mm256_store_ps(target + c * stride + kHalf, high[c]);
  }
}

PALPATE_AVX2 bool eliminate_columns_avx2(float* matrix, uint32_t stride, uint32_t size, uint32_t eliminated,
                                         uint32_t first) {
  const bool inside = first < eliminated;
  const uint32_t columns = inside ? first : eliminated;
  DiagonalBlock block = {};
  __m256 low[kColumns];
  __m256 high[kColumns];
  for (uint32_t row = first / kEliminationRows * kEliminationRows; row < size; row += kEliminationRows) {
    float* target = matrix + size_t{first} * stride + row;
    subtract_avx2(matrix, stride, row, first, columns, low, high);
    if (inside && row <= first) {
      store_avx2(low, high, stride, target);
      if (!factor_block(matrix + size_t{first} * stride + first, stride, block)) return false;
    }
    PALPATE_UNROLL
    for (uint32_t c = 0; c < kColumns; ++c) {
      if (!inside) break;
      PALPATE_UNROLL
      for (uint32_t k = 0; k < c; ++k) {
        const __m256 factor = _mm256_broadcast_ss(&block.below[c][k]);
        low[c] = _mm256_fnmadd_ps(low[k], factor, low[c]);
        high[c] = _mm256_fnmadd_ps(high[k], factor, high[c]);
      }
      const __m256 inverse = _mm256_broadcast_ss(&block.inverse[c]);
      low[c] = _mm256_mul_ps(low[c], inverse);
      high[c] = _mm256_mul_ps(high[c], inverse);
    }
    store_avx2(low, high, stride, target);
  }
  return true;
}

// Entry c of the result is the sum of the entries of v[c].
PALPATE_AVX2 inline __m256d sums_of(const __m256d v[kColumns]) {
  const __m256d low = _mm256_hadd_pd(v[0], v[1]);
  const __m256d high = _mm256_hadd_pd(v[2], v[3]);
  return _mm256_add_pd(_mm256_permute2f128_pd(low, high, 0x21), _mm256_blend_pd(low, high, 0xc));
}

// row := L^-T row, L the diagonal triangle of four columns.
void solve_transposed(const float* block, uint32_t stride, double* row) {
  double inverse[kColumns];  // reciprocals first: no division waits for another division
  for (uint32_t c = 0; c < kColumns; ++c) inverse[c] = 1.0 / static_cast<double>(block[c * stride + c]);
  for (uint32_t c = kColumns; c-- > 0;) {
    double entry = row[c];
    for (uint32_t r = c + 1; r < kColumns; ++r) entry -= static_cast<double>(block[c * stride + r]) * row[r];
    row[c] = entry * inverse[c];
  }
}

// Solves for kCount right-hand sides, stored as rows, which share each load of the matrix.
template <uint32_t kCount>
PALPATE_AVX2 void back_substitute_few(const float* matrix, uint32_t stride, uint32_t size, double* rows,
                                      size_t row_stride) {
  for (uint32_t first = size; first > 0;) {
    first -= kColumns;
    const float* columns = matrix + size_t{first} * stride;
    __m256d sums[kCount][kColumns];
    PALPATE_UNROLL
    for (uint32_t t = 0; t < kCount; ++t) {
      PALPATE_UNROLL
      for (uint32_t c = 0; c < kColumns; ++c) sums[t][c] = _mm256_setzero_pd();
    }
    for (uint32_t i = first + kColumns; i < size; i += 4) {
      __m256d vector[kCount];
      PALPATE_UNROLL
      for (uint32_t t = 0; t < kCount; ++t) vector[t] = _mm256_load_pd(rows + t * row_stride + i);
      PALPATE_UNROLL
      for (uint32_t c = 0; c < kColumns; ++c) {
        const __m256d entries = load_four(columns + c * stride + i);
        PALPATE_UNROLL
        for (uint32_t t = 0; t < kCount; ++t) sums[t][c] = _mm256_fmadd_pd(entries, vector[t], sums[t][c]);
      }
    }
    PALPATE_UNROLL
    for (uint32_t t = 0; t < kCount; ++t) {
      double* row = rows + t * row_stride + first;
      _mm256_store_pd(row, _mm256_sub_pd(_mm256_load_pd(row), sums_of(sums[t])));
      solve_transposed(columns + first, stride, row);
    }
  }
}

void back_substitute_avx2(const float* matrix, uint32_t stride, uint32_t size, double* rows,
                          size_t row_stride, uint32_t count) {
  for (; count >= 3; count -= 3, rows += 3 * row_stride)
    back_substitute_few<3>(matrix, stride, size, rows, row_stride);
  for (; count > 0; --count, rows += row_stride)
    back_substitute_few<1>(matrix, stride, size, rows, row_stride);
}

PALPATE_AVX2 void forward_substitute_avx2(const float* matrix, uint32_t stride, uint32_t size,
                                          double* vector) {
  for (uint32_t first = 0; first < size; first += kColumns) {
    const float* columns = matrix + size_t{first} * stride;
    solve_triangle(columns + first, stride, vector + first);
    __m256d factors[kColumns];
    PALPATE_UNROLL
    for (uint32_t c = 0; c < kColumns; ++c) factors[c] = _mm256_broadcast_sd(vector + first + c);
    for (uint32_t i = first + kColumns; i < size; i += 4) {
      __m256d sum = _mm256_load_pd(vector + i);
      PALPATE_UNROLL
      for (uint32_t c = 0; c < kColumns; ++c)
        sum = _mm256_fnmadd_pd(load_four(columns + c * stride + i), factors[c], sum);
      _mm256_store_pd(vector + i, sum);
    }
  }
}

// Sixteen rows at a time give independent sums.
PALPATE_AVX2 void add_product_avx2(const float* matrix, uint32_t stride, uint32_t rows, uint32_t columns,
                                   const double* x, double* y) {
  uint32_t i = 0;
  for (; i + 16 <= rows; i += 16) {
    __m256d sums[4];
    PALPATE_UNROLL
    for (uint32_t k = 0; k < 4; ++k) sums[k] = _mm256_load_pd(y + i + 4 * k);
    const float* entries = matrix + i;
    for (uint32_t j = 0; j < columns; ++j, entries += stride) {
      const __m256d factor = _mm256_broadcast_sd(x + j);
      PALPATE_UNROLL
      for (uint32_t k = 0; k < 4; ++k) sums[k] = _mm256_fmadd_pd(load_four(entries + 4 * k), factor, sums[k]);
    }
    PALPATE_UNROLL
    for (uint32_t k = 0; k < 4; ++k) _mm256_store_pd(y + i + 4 * k, sums[k]);
  }
  for (; i < rows; i += 4) {
    __m256d sum = _mm256_load_pd(y + i);
    const float* entries = matrix + i;
    for (uint32_t j = 0; j < columns; ++j, entries += stride)
      sum = _mm256_fmadd_pd(load_four(entries), _mm256_broadcast_sd(x + j), sum);
    _mm256_store_pd(y + i, sum);
  }
}

PALPATE_AVX2 void add_transposed_product_avx2(const float* matrix, uint32_t stride, uint32_t rows,
                                              uint32_t columns, const double* x, double* y) {
  for (uint32_t first = 0; first < columns; first += kColumns) {
    const float* entries = matrix + size_t{first} * stride;
    __m256d sums[kColumns];
    PALPATE_UNROLL
    for (uint32_t c = 0; c < kColumns; ++c) sums[c] = _mm256_setzero_pd();
    for (uint32_t i = 0; i < rows; i += 4) {
      const __m256d factor = _mm256_load_pd(x + i);
      PALPATE_UNROLL
      for (uint32_t c = 0; c < kColumns; ++c)
        sums[c] = _mm256_fmadd_pd(load_four(entries + c * size_t{stride} + i), factor, sums[c]);
    }
    _mm256_store_pd(y + first, _mm256_add_pd(_mm256_load_pd(y + first), sums_of(sums)));
  }
}

// Takes four columns at a time, and reads the diagonal block in full.
PALPATE_AVX2 void add_symmetric_product_avx2(const float* matrix, uint32_t size, const double* x, double* y) {
  for (uint32_t first = 0; first < size; first += kColumns) {
    const float* columns = matrix + size_t{first} * size;
    __m256d factors[kColumns];
    __m256d sums[kColumns];
    __m256d diagonal = _mm256_load_pd(y + first);
    PALPATE_UNROLL
    for (uint32_t c = 0; c < kColumns; ++c) {
      factors[c] = _mm256_broadcast_sd(x + first + c);
      sums[c] = _mm256_setzero_pd();
      diagonal = _mm256_fmadd_pd(load_four(columns + c * size + first), factors[c], diagonal);
    }
    for (uint32_t i = first + kColumns; i < size; i += 4) {
      const __m256d factor = _mm256_load_pd(x + i);
      __m256d sum = _mm256_load_pd(y + i);
      PALPATE_UNROLL
      for (uint32_t c = 0; c < kColumns; ++c) {
        const __m256d entries = load_four(columns + c * size + i);
        sum = _mm256_fmadd_pd(entries, factors[c], sum);
        sums[c] = _mm256_fmadd_pd(entries, factor, sums[c]);
      }
      _mm256_store_pd(y + i, sum);
    }
    _mm256_store_pd(y + first, _mm256_add_pd(diagonal, sums_of(sums)));
  }
}

}  // namespace

EliminationKernel avx2_elimination_kernel() {
  return {"avx2",           eliminate_columns_avx2,      back_substitute_avx2,      forward_substitute_avx2,
          add_product_avx2, add_transposed_product_avx2, add_symmetric_product_avx2};
}

}  // namespace palpate

#endif
