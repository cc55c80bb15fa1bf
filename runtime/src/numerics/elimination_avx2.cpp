// The AVX2 kernel of elimination.hpp.
#include "runtime/src/numerics/elimination_block.hpp"

#ifdef PALPATE_X86

#include <immintrin.h>

namespace palpate {
namespace {

constexpr uint32_t kColumns = kEliminationColumns;

#define PALPATE_AVX2 __attribute__((target("avx2,fma")))
// Unrolled loops keep arrays of registers in registers.
#define PALPATE_UNROLL _Pragma("GCC unroll 4")

PALPATE_AVX2 inline __m256d load_four(const double* entries) {
  return _mm256_load_pd(entries);
}

PALPATE_AVX2 inline __m256d load_four(const float* entries) {
  return _mm256_cvtps_pd(_mm_load_ps(entries));
}

template <typename Number>
struct VectorOf {
  using Type = __m256d;
};
template <>
struct VectorOf<float> {
  using Type = __m256;
};
template <typename Number>
using Vector = typename VectorOf<Number>::Type;

PALPATE_AVX2 inline __m256d load(const double* at) {
  return _mm256_load_pd(at);
}
PALPATE_AVX2 inline __m256 load(const float* at) {
  return _mm256_load_ps(at);
}
PALPATE_AVX2 inline void store(double* at, __m256d v) {
  _mm256_store_pd(at, v);
}
PALPATE_AVX2 inline void store(float* at, __m256 v) {
  _mm256_store_ps(at, v);
}
PALPATE_AVX2 inline __m256d spread(const double* at) {
  return _mm256_broadcast_sd(at);
}
PALPATE_AVX2 inline __m256 spread(const float* at) {
  return _mm256_broadcast_ss(at);
}
PALPATE_AVX2 inline __m256d subtract_product(__m256d sum, __m256d a, __m256d b) {
  return _mm256_fnmadd_pd(a, b, sum);
}
PALPATE_AVX2 inline __m256 subtract_product(__m256 sum, __m256 a, __m256 b) {
  return _mm256_fnmadd_ps(a, b, sum);
}
PALPATE_AVX2 inline __m256d times(__m256d a, __m256d b) {
  return _mm256_mul_pd(a, b);
}
PALPATE_AVX2 inline __m256 times(__m256 a, __m256 b) {
  return _mm256_mul_ps(a, b);
}

// Loads a tile and subtracts the products of the columns before it. A tile is two vectors high. A third vector would
// hide more latency, but would waste half of the tile on padding in such small matrices.
template <typename Number>
PALPATE_AVX2 inline void subtract_avx2(const Number* matrix, uint32_t stride, uint32_t row, uint32_t first,
                                       uint32_t columns, Vector<Number> low[kColumns],
                                       Vector<Number> high[kColumns]) {
  constexpr uint32_t kHalf = 32 / sizeof(Number);
  const Number* target = matrix + size_t{first} * stride + row;
  PALPATE_UNROLL
  for (uint32_t c = 0; c < kColumns; ++c) {
    low[c] = load(target + c * stride);
    high[c] = load(target + c * stride + kHalf);
  }
  const Number* rows = matrix + row;
  const Number* factors = matrix + first;
  for (uint32_t k = 0; k < columns; ++k, rows += stride, factors += stride) {
    const Vector<Number> a = load(rows);
    const Vector<Number> b = load(rows + kHalf);
    PALPATE_UNROLL
    for (uint32_t c = 0; c < kColumns; ++c) {
      const Vector<Number> factor = spread(factors + c);
      low[c] = subtract_product(low[c], a, factor);
      high[c] = subtract_product(high[c], b, factor);
    }
  }
}

template <typename Number>
PALPATE_AVX2 inline void store_avx2(const Vector<Number> low[kColumns], const Vector<Number> high[kColumns],
                                    uint32_t stride, Number* target) {
  PALPATE_UNROLL
  for (uint32_t c = 0; c < kColumns; ++c) {
    store(target + c * stride, low[c]);
    store(target + c * stride + 32 / sizeof(Number), high[c]);
  }
}

template <typename Number>
PALPATE_AVX2 bool eliminate_columns_avx2(Number* matrix, uint32_t stride, uint32_t size, uint32_t eliminated,
                                         uint32_t first) {
  constexpr uint32_t kRows = 64 / sizeof(Number);
  const bool inside = first < eliminated;
  const uint32_t columns = inside ? first : eliminated;
  DiagonalBlock<Number> block = {};
  Vector<Number> low[kColumns];
  Vector<Number> high[kColumns];
  for (uint32_t row = first / kRows * kRows; row < size; row += kRows) {
    Number* target = matrix + size_t{first} * stride + row;
    subtract_avx2<Number>(matrix, stride, row, first, columns, low, high);
    if (inside && row <= first) {
      store_avx2<Number>(low, high, stride, target);
      if (!factor_block(matrix + size_t{first} * stride + first, stride, block)) return false;
    }
    PALPATE_UNROLL
    for (uint32_t c = 0; c < kColumns; ++c) {
      if (!inside) break;
      PALPATE_UNROLL
      for (uint32_t k = 0; k < c; ++k) {
        const Vector<Number> factor = spread(&block.below[c][k]);
        low[c] = subtract_product(low[c], low[k], factor);
        high[c] = subtract_product(high[c], high[k], factor);
      }
      const Vector<Number> inverse = spread(&block.inverse[c]);
      low[c] = times(low[c], inverse);
      high[c] = times(high[c], inverse);
    }
    store_avx2<Number>(low, high, stride, target);
  }
  return true;
}

// Entry c of the result is the sum of the entries of v[c].
PALPATE_AVX2 inline __m256d sums_of(const __m256d v[kColumns]) {
  const __m256d low = _mm256_hadd_pd(v[0], v[1]);
  const __m256d high = _mm256_hadd_pd(v[2], v[3]);
  return _mm256_add_pd(_mm256_permute2f128_pd(low, high, 0x21), _mm256_blend_pd(low, high, 0xc));
}

// Solves with the transposed diagonal triangle of four columns.
template <typename Number>
void solve_transposed(const Number* block, uint32_t stride, double* row) {
  double inverse[kColumns];  // reciprocals first: no division waits for another division
  for (uint32_t c = 0; c < kColumns; ++c) inverse[c] = 1.0 / static_cast<double>(block[c * stride + c]);
  for (uint32_t c = kColumns; c-- > 0;) {
    double entry = row[c];
    for (uint32_t r = c + 1; r < kColumns; ++r) entry -= static_cast<double>(block[c * stride + r]) * row[r];
    row[c] = entry * inverse[c];
  }
}

// Solves for kCount right-hand sides, stored as rows, which share each load of the matrix.
template <uint32_t kCount, typename Number>
PALPATE_AVX2 void back_substitute_few(const Number* matrix, uint32_t stride, uint32_t size, double* rows,
                                      size_t row_stride) {
  for (uint32_t first = size; first > 0;) {
    first -= kColumns;
    const Number* columns = matrix + size_t{first} * stride;
    __m256d wide[kCount][kColumns];
    PALPATE_UNROLL
    for (uint32_t t = 0; t < kCount; ++t) {
      PALPATE_UNROLL
      for (uint32_t c = 0; c < kColumns; ++c) wide[t][c] = _mm256_setzero_pd();
    }
    for (uint32_t i = first + kColumns; i < size; i += 4) {
      __m256d of_row[kCount];
      PALPATE_UNROLL
      for (uint32_t t = 0; t < kCount; ++t) of_row[t] = _mm256_load_pd(rows + t * row_stride + i);
      PALPATE_UNROLL
      for (uint32_t c = 0; c < kColumns; ++c) {
        const __m256d entries = load_four(columns + c * stride + i);
        PALPATE_UNROLL
        for (uint32_t t = 0; t < kCount; ++t) wide[t][c] = _mm256_fmadd_pd(entries, of_row[t], wide[t][c]);
      }
    }
    PALPATE_UNROLL
    for (uint32_t t = 0; t < kCount; ++t) {
      double* row = rows + t * row_stride + first;
      _mm256_store_pd(row, _mm256_sub_pd(_mm256_load_pd(row), sums_of(wide[t])));
      solve_transposed(columns + first, stride, row);
    }
  }
}

void back_substitute_avx2(const double* matrix, uint32_t stride, uint32_t size, double* rows,
                          size_t row_stride, uint32_t count) {
  for (; count >= 3; count -= 3, rows += 3 * row_stride)
    back_substitute_few<3>(matrix, stride, size, rows, row_stride);
  for (; count > 0; --count, rows += row_stride)
    back_substitute_few<1>(matrix, stride, size, rows, row_stride);
}

void back_substitute_floats(const float* matrix, uint32_t stride, uint32_t size, double* vector) {
  back_substitute_few<1>(matrix, stride, size, vector, 0);
}

template <typename Number>
PALPATE_AVX2 void forward_substitute_avx2(const Number* matrix, uint32_t stride, uint32_t size,
                                          double* vector) {
  for (uint32_t first = 0; first < size; first += kColumns) {
    const Number* columns = matrix + size_t{first} * stride;
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
template <typename Number>
PALPATE_AVX2 void add_product_avx2(const Number* matrix, uint32_t stride, uint32_t rows, uint32_t columns,
                                   const double* x, double* y) {
  uint32_t i = 0;
  for (; i + 16 <= rows; i += 16) {
    __m256d sums[4];
    PALPATE_UNROLL
    for (uint32_t k = 0; k < 4; ++k) sums[k] = _mm256_load_pd(y + i + 4 * k);
    const Number* entries = matrix + i;
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
    const Number* entries = matrix + i;
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
      const __m256d of_row = _mm256_load_pd(x + i);
      PALPATE_UNROLL
      for (uint32_t c = 0; c < kColumns; ++c)
        sums[c] = _mm256_fmadd_pd(load_four(entries + c * size_t{stride} + i), of_row, sums[c]);
    }
    _mm256_store_pd(y + first, _mm256_add_pd(_mm256_load_pd(y + first), sums_of(sums)));
  }
}

// Four columns at a time. The loop reads the diagonal block in full.
PALPATE_AVX2 void add_symmetric_product_avx2(const double* matrix, uint32_t size, const double* x,
                                             double* y) {
  for (uint32_t first = 0; first < size; first += kColumns) {
    const double* columns = matrix + size_t{first} * size;
    __m256d factors[kColumns];
    __m256d sums[kColumns];
    __m256d own = _mm256_load_pd(y + first);
    PALPATE_UNROLL
    for (uint32_t c = 0; c < kColumns; ++c) {
      factors[c] = _mm256_broadcast_sd(x + first + c);
      sums[c] = _mm256_setzero_pd();
      own = _mm256_fmadd_pd(_mm256_load_pd(columns + c * size + first), factors[c], own);
    }
    for (uint32_t i = first + kColumns; i < size; i += 4) {
      const __m256d of_row = _mm256_load_pd(x + i);
      __m256d sum = _mm256_load_pd(y + i);
      PALPATE_UNROLL
      for (uint32_t c = 0; c < kColumns; ++c) {
        const __m256d entries = _mm256_load_pd(columns + c * size + i);
        sum = _mm256_fmadd_pd(entries, factors[c], sum);
        sums[c] = _mm256_fmadd_pd(entries, of_row, sums[c]);
      }
      _mm256_store_pd(y + i, sum);
    }
    _mm256_store_pd(y + first, _mm256_add_pd(own, sums_of(sums)));
  }
}

}  // namespace

EliminationKernel avx2_elimination_kernel() {
  return {"avx2",
          eliminate_columns_avx2<double>,
          eliminate_columns_avx2<float>,
          back_substitute_avx2,
          forward_substitute_avx2<double>,
          back_substitute_floats,
          forward_substitute_avx2<float>,
          add_product_avx2<double>,
          add_product_avx2<float>,
          add_transposed_product_avx2,
          add_symmetric_product_avx2};
}

}  // namespace palpate

#endif
