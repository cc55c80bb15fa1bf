#include "runtime/src/numerics/elimination.hpp"

#include <math.h>

#if defined(__x86_64__) && !defined(PALPATE_SCALAR_ONLY)
#include <immintrin.h>
#define PALPATE_X86 1
#endif

namespace palpate {
namespace {

constexpr uint32_t kRows = kEliminationRows;
constexpr uint32_t kColumns = kEliminationColumns;

// The Cholesky factor of a diagonal block: L below the diagonal, and the reciprocals of L's diagonal.
struct DiagonalBlock {
  double below[kColumns][kColumns];
  double inverse[kColumns];
};

// False if the block is not positive definite to rounding.
bool factor_block(const double* block, uint32_t stride, DiagonalBlock& factor) {
  constexpr double kLeastPivot = 1e-13;  // relative to the diagonal before this block's elimination
  for (uint32_t c = 0; c < kColumns; ++c) {
    const double diagonal = block[c * stride + c];
    double pivot = diagonal;
    for (uint32_t k = 0; k < c; ++k) pivot -= factor.below[c][k] * factor.below[c][k];
    if (!(pivot > kLeastPivot * fabs(diagonal)) || !isfinite(pivot)) return false;
    factor.inverse[c] = 1.0 / sqrt(pivot);
    for (uint32_t r = c + 1; r < kColumns; ++r) {
      double entry = block[c * stride + r];
      for (uint32_t k = 0; k < c; ++k) entry -= factor.below[r][k] * factor.below[c][k];
      factor.below[r][c] = entry * factor.inverse[c];
    }
  }
  return true;
}

// Updates a block of columns from its diagonal down, by tiles of kRows rows: subtracts the products of all
// earlier columns, then solves with the block's own triangle.
struct ScalarTile {
  double entries[kColumns][kRows];

  void subtract(const double* matrix, uint32_t stride, uint32_t row, uint32_t first, uint32_t columns) {
    const double* target = matrix + size_t{first} * stride + row;
    for (uint32_t c = 0; c < kColumns; ++c) {
      for (uint32_t r = 0; r < kRows; ++r) entries[c][r] = target[c * stride + r];
    }
    for (uint32_t k = 0; k < columns; ++k) {
      const double* column = matrix + size_t{k} * stride;
      for (uint32_t c = 0; c < kColumns; ++c) {
        for (uint32_t r = 0; r < kRows; ++r) entries[c][r] -= column[row + r] * column[first + c];
      }
    }
  }
  void solve(const DiagonalBlock& block) {
    for (uint32_t c = 0; c < kColumns; ++c) {
      for (uint32_t r = 0; r < kRows; ++r) {
        for (uint32_t k = 0; k < c; ++k) entries[c][r] -= entries[k][r] * block.below[c][k];
        entries[c][r] *= block.inverse[c];
      }
    }
  }
  void store(double* target, uint32_t stride) const {
    for (uint32_t c = 0; c < kColumns; ++c) {
      for (uint32_t r = 0; r < kRows; ++r) target[c * stride + r] = entries[c][r];
    }
  }
};

bool eliminate_columns_scalar(double* matrix, uint32_t stride, uint32_t size, uint32_t eliminated,
                              uint32_t first) {
  const bool inside = first < eliminated;
  const uint32_t columns = inside ? first : eliminated;
  DiagonalBlock block;
  ScalarTile tile;
  for (uint32_t row = first / kRows * kRows; row < size; row += kRows) {
    double* target = matrix + size_t{first} * stride + row;
    tile.subtract(matrix, stride, row, first, columns);
    if (inside && row <= first) {
      tile.store(target, stride);
      if (!factor_block(matrix + size_t{first} * stride + first, stride, block)) return false;
    }
    if (inside) tile.solve(block);
    tile.store(target, stride);
  }
  return true;
}

void back_substitute_scalar(const double* matrix, uint32_t stride, uint32_t size, double* rows,
                            size_t row_stride, uint32_t count) {
  for (uint32_t j = size; j-- > 0;) {
    const double* column = matrix + size_t{j} * stride;
    const double inverse = 1.0 / column[j];
    for (uint32_t t = 0; t < count; ++t) {
      double* row = rows + t * row_stride;
      double sum = row[j];
      for (uint32_t i = j + 1; i < size; ++i) sum -= column[i] * row[i];
      row[j] = sum * inverse;
    }
  }
}

// Solves with the diagonal triangle of four columns.
void solve_triangle(const double* block, uint32_t stride, double* vector) {
  double inverse[kColumns];  // reciprocals first: no division waits for another division
  for (uint32_t c = 0; c < kColumns; ++c) inverse[c] = 1.0 / block[c * stride + c];
  for (uint32_t c = 0; c < kColumns; ++c) {
    double entry = vector[c];
    for (uint32_t k = 0; k < c; ++k) entry -= block[k * stride + c] * vector[k];
    vector[c] = entry * inverse[c];
  }
}

void forward_substitute_scalar(const double* matrix, uint32_t stride, uint32_t size, double* vector) {
  for (uint32_t first = 0; first < size; first += kColumns) {
    const double* columns = matrix + size_t{first} * stride;
    solve_triangle(columns + first, stride, vector + first);
    for (uint32_t c = 0; c < kColumns; ++c) {
      for (uint32_t i = first + kColumns; i < size; ++i)
        vector[i] -= columns[c * stride + i] * vector[first + c];
    }
  }
}

template <typename Number>
void add_product_scalar(const Number* matrix, uint32_t stride, uint32_t rows, uint32_t columns,
                        const double* x, double* y) {
  for (uint32_t j = 0; j < columns; ++j) {
    const Number* column = matrix + size_t{j} * stride;
    for (uint32_t i = 0; i < rows; ++i) y[i] += static_cast<double>(column[i]) * x[j];
  }
}

void add_transposed_product_scalar(const float* matrix, uint32_t stride, uint32_t rows, uint32_t columns,
                                   const double* x, double* y) {
  for (uint32_t j = 0; j < columns; ++j) {
    const float* column = matrix + size_t{j} * stride;
    double sum = 0;
    for (uint32_t i = 0; i < rows; ++i) sum += static_cast<double>(column[i]) * x[i];
    y[j] += sum;
  }
}

void add_symmetric_product_scalar(const double* matrix, uint32_t size, const double* x, double* y) {
  for (uint32_t j = 0; j < size; ++j) {
    const double* column = matrix + size_t{j} * size;
    double sum = column[j] * x[j];
    for (uint32_t i = j + 1; i < size; ++i) {
      y[i] += column[i] * x[j];
      sum += column[i] * x[i];
    }
    y[j] += sum;
  }
}

#ifdef PALPATE_X86

#define PALPATE_AVX2 __attribute__((target("avx2,fma")))
// Unrolled loops keep arrays of registers in registers.
#define PALPATE_UNROLL _Pragma("GCC unroll 4")

// Sixteen rows would hide more latency, but would waste half of the tile on padding in such small matrices.
PALPATE_AVX2 inline void subtract_avx2(const double* matrix, uint32_t stride, uint32_t row, uint32_t first,
                                       uint32_t columns, __m256d low[kColumns], __m256d high[kColumns]) {
  const double* target = matrix + size_t{first} * stride + row;
  PALPATE_UNROLL
  for (uint32_t c = 0; c < kColumns; ++c) {
    low[c] = _mm256_load_pd(target + c * stride);
    high[c] = _mm256_load_pd(target + c * stride + 4);
  }
  const double* rows = matrix + row;
  const double* factors = matrix + first;
  for (uint32_t k = 0; k < columns; ++k, rows += stride, factors += stride) {
    const __m256d a = _mm256_load_pd(rows);
    const __m256d b = _mm256_load_pd(rows + 4);
    PALPATE_UNROLL
    for (uint32_t c = 0; c < kColumns; ++c) {
      const __m256d factor = _mm256_broadcast_sd(factors + c);
      low[c] = _mm256_fnmadd_pd(a, factor, low[c]);
      high[c] = _mm256_fnmadd_pd(b, factor, high[c]);
    }
  }
}

PALPATE_AVX2 inline void store_avx2(const __m256d low[kColumns], const __m256d high[kColumns],
                                    uint32_t stride, double* target) {
  PALPATE_UNROLL
  for (uint32_t c = 0; c < kColumns; ++c) {
    _mm256_store_pd(target + c * stride, low[c]);
    _mm256_store_pd(target + c * stride + 4, high[c]);
  }
}

PALPATE_AVX2 bool eliminate_columns_avx2(double* matrix, uint32_t stride, uint32_t size, uint32_t eliminated,
                                         uint32_t first) {
  const bool inside = first < eliminated;
  const uint32_t columns = inside ? first : eliminated;
  DiagonalBlock block;
  __m256d low[kColumns];
  __m256d high[kColumns];
  for (uint32_t row = first / kRows * kRows; row < size; row += kRows) {
    double* target = matrix + size_t{first} * stride + row;
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
        const __m256d factor = _mm256_broadcast_sd(&block.below[c][k]);
        low[c] = _mm256_fnmadd_pd(low[k], factor, low[c]);
        high[c] = _mm256_fnmadd_pd(high[k], factor, high[c]);
      }
      const __m256d inverse = _mm256_broadcast_sd(&block.inverse[c]);
      low[c] = _mm256_mul_pd(low[c], inverse);
      high[c] = _mm256_mul_pd(high[c], inverse);
    }
    store_avx2(low, high, stride, target);
  }
  return true;
}

// The sums of four vectors.
PALPATE_AVX2 inline __m256d sums_of(const __m256d v[kColumns]) {
  const __m256d low = _mm256_hadd_pd(v[0], v[1]);
  const __m256d high = _mm256_hadd_pd(v[2], v[3]);
  return _mm256_add_pd(_mm256_permute2f128_pd(low, high, 0x21), _mm256_blend_pd(low, high, 0xc));
}

// Solves with the transposed diagonal triangle of four columns.
void solve_transposed(const double* block, uint32_t stride, double* row) {
  double inverse[kColumns];  // reciprocals first: no division waits for another division
  for (uint32_t c = 0; c < kColumns; ++c) inverse[c] = 1.0 / block[c * stride + c];
  for (uint32_t c = kColumns; c-- > 0;) {
    double entry = row[c];
    for (uint32_t r = c + 1; r < kColumns; ++r) entry -= block[c * stride + r] * row[r];
    row[c] = entry * inverse[c];
  }
}

// kCount rows share each column read, and each row uses four columns.
template <uint32_t kCount>
PALPATE_AVX2 void back_substitute_few(const double* matrix, uint32_t stride, uint32_t size, double* rows,
                                      size_t row_stride) {
  for (uint32_t first = size; first > 0;) {
    first -= kColumns;
    const double* columns = matrix + size_t{first} * stride;
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
        const __m256d entries = _mm256_load_pd(columns + c * stride + i);
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

PALPATE_AVX2 void forward_substitute_avx2(const double* matrix, uint32_t stride, uint32_t size,
                                          double* vector) {
  for (uint32_t first = 0; first < size; first += kColumns) {
    const double* columns = matrix + size_t{first} * stride;
    solve_triangle(columns + first, stride, vector + first);
    __m256d factors[kColumns];
    PALPATE_UNROLL
    for (uint32_t c = 0; c < kColumns; ++c) factors[c] = _mm256_broadcast_sd(vector + first + c);
    for (uint32_t i = first + kColumns; i < size; i += 4) {
      __m256d sum = _mm256_load_pd(vector + i);
      PALPATE_UNROLL
      for (uint32_t c = 0; c < kColumns; ++c)
        sum = _mm256_fnmadd_pd(_mm256_load_pd(columns + c * stride + i), factors[c], sum);
      _mm256_store_pd(vector + i, sum);
    }
  }
}

PALPATE_AVX2 inline __m256d load_four(const double* entries) {
  return _mm256_load_pd(entries);
}

PALPATE_AVX2 inline __m256d load_four(const float* entries) {
  return _mm256_cvtps_pd(_mm_load_ps(entries));
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

#endif

}  // namespace

uint32_t list_elimination_kernels(EliminationKernel kernels[kMostEliminationKernels]) {
  uint32_t count = 0;
  kernels[count++] = {"scalar",
                      eliminate_columns_scalar,
                      back_substitute_scalar,
                      forward_substitute_scalar,
                      add_product_scalar<double>,
                      add_product_scalar<float>,
                      add_transposed_product_scalar,
                      add_symmetric_product_scalar};
#ifdef PALPATE_X86
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
    kernels[count++] = {"avx2",
                        eliminate_columns_avx2,
                        back_substitute_avx2,
                        forward_substitute_avx2,
                        add_product_avx2<double>,
                        add_product_avx2<float>,
                        add_transposed_product_avx2,
                        add_symmetric_product_avx2};
#endif
  return count;
}

EliminationKernel choose_elimination_kernel() {
  EliminationKernel kernels[kMostEliminationKernels];
  const uint32_t count = list_elimination_kernels(kernels);
  return kernels[count - 1];
}

void drop_unknown(uint32_t unknown, uint32_t size, uint32_t stride, double* matrix) {
  for (uint32_t column = 0; column < unknown; ++column) matrix[size_t{column} * stride + unknown] = 0;
  for (uint32_t row = unknown; row < size; ++row) matrix[size_t{unknown} * stride + row] = 0;
  matrix[size_t{unknown} * stride + unknown] = 1;
}

bool eliminate(const EliminationKernel& kernel, double* matrix, uint32_t stride, uint32_t size,
               uint32_t eliminated) {
  for (uint32_t first = 0; first < size; first += kEliminationColumns) {
    if (!kernel.eliminate_columns(matrix, stride, size, eliminated, first)) return false;
  }
  return true;
}

}  // namespace palpate
