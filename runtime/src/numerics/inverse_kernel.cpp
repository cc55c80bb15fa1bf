#include "runtime/src/numerics/inverse_kernel.hpp"

#include <string.h>

#if defined(__x86_64__) && !defined(PALPATE_SCALAR_ONLY)
#include <immintrin.h>
#define PALPATE_X86 1
#endif

namespace palpate {
namespace {

void multiply_scalar(const double* matrix, size_t stride, uint32_t num_nodes, const double* x, double* y) {
  const size_t n = size_t{3} * num_nodes;
  for (size_t r = 0; r < 3; ++r) {
    double* sum = y + r * stride;
    memset(sum, 0, n * sizeof *sum);
    for (size_t i = 0; i < n; ++i) {
      const double* row = matrix + i * stride;
      const double factor = x[r * stride + i];
      for (size_t j = 0; j < n; ++j) sum[j] += factor * row[j];
    }
  }
}

void add_products_scalar(double* matrix, size_t stride, uint32_t num_nodes, const double* p,
                         const double* q) {
  const size_t n = size_t{3} * num_nodes;
  for (size_t i = 0; i < n; ++i) {
    double* row = matrix + i * stride;
    for (size_t r = 0; r < 3; ++r) {
      const double factor = p[r * stride + i];
      for (size_t j = 0; j < n; ++j) row[j] += factor * q[r * stride + j];
    }
  }
}

void combine_scalar(const double* rows, size_t stride, uint32_t count, const double* weights, size_t length,
                    double* out) {
  memset(out, 0, length * sizeof *out);
  for (uint32_t j = 0; j < count; ++j) {
    for (size_t i = 0; i < length; ++i) out[i] += weights[j] * rows[j * stride + i];
  }
}

#ifdef PALPATE_X86

// The loops take the three rows of a node together. Nine factors and three columns stay in registers, so that
// nine multiply-adds need three numbers of the matrix.

__attribute__((target("avx2,fma"))) void multiply_avx2(const double* matrix, size_t stride,
                                                       uint32_t num_nodes, const double* x, double* y) {
  const size_t n = size_t{3} * num_nodes;
  for (size_t r = 0; r < 3; ++r) memset(y + r * stride, 0, n * sizeof *y);
  for (size_t i = 0; i < n; i += 3) {
    __m256d factors[3][3];
    for (size_t r = 0; r < 3; ++r) {
      for (size_t a = 0; a < 3; ++a) factors[r][a] = _mm256_broadcast_sd(x + r * stride + i + a);
    }
    const double* rows = matrix + i * stride;
    for (size_t j = 0; j < n; j += 4) {
      const __m256d row[3] = {_mm256_load_pd(rows + j), _mm256_load_pd(rows + stride + j),
                              _mm256_load_pd(rows + 2 * stride + j)};
      for (size_t r = 0; r < 3; ++r) {
        __m256d sum = _mm256_load_pd(y + r * stride + j);
        for (size_t a = 0; a < 3; ++a) sum = _mm256_fmadd_pd(factors[r][a], row[a], sum);
        _mm256_store_pd(y + r * stride + j, sum);
      }
    }
  }
}

__attribute__((target("avx2,fma"))) void add_products_avx2(double* matrix, size_t stride, uint32_t num_nodes,
                                                           const double* p, const double* q) {
  const size_t n = size_t{3} * num_nodes;
  for (size_t i = 0; i < n; i += 3) {
    __m256d factors[3][3];
    for (size_t a = 0; a < 3; ++a) {
      for (size_t r = 0; r < 3; ++r) factors[a][r] = _mm256_broadcast_sd(p + r * stride + i + a);
    }
    double* rows = matrix + i * stride;
    for (size_t j = 0; j < n; j += 4) {
      const __m256d column[3] = {_mm256_load_pd(q + j), _mm256_load_pd(q + stride + j),
                                 _mm256_load_pd(q + 2 * stride + j)};
      for (size_t a = 0; a < 3; ++a) {
        __m256d sum = _mm256_load_pd(rows + a * stride + j);
        for (size_t r = 0; r < 3; ++r) sum = _mm256_fmadd_pd(factors[a][r], column[r], sum);
        _mm256_store_pd(rows + a * stride + j, sum);
      }
    }
  }
}

// Sixteen sums stay in registers while the loop passes all rows. A row ends with the padding of its stride.
__attribute__((target("avx2,fma"))) void combine_avx2(const double* rows, size_t stride, uint32_t count,
                                                      const double* weights, size_t length, double* out) {
  size_t i = 0;
  for (; i + 16 <= length; i += 16) {
    __m256d a = _mm256_setzero_pd();
    __m256d b = a;
    __m256d c = a;
    __m256d d = a;
    const double* row = rows + i;
    for (uint32_t j = 0; j < count; ++j, row += stride) {
      const __m256d weight = _mm256_broadcast_sd(weights + j);
      a = _mm256_fmadd_pd(weight, _mm256_load_pd(row), a);
      b = _mm256_fmadd_pd(weight, _mm256_load_pd(row + 4), b);
      c = _mm256_fmadd_pd(weight, _mm256_load_pd(row + 8), c);
      d = _mm256_fmadd_pd(weight, _mm256_load_pd(row + 12), d);
    }
    _mm256_store_pd(out + i, a);
    _mm256_store_pd(out + i + 4, b);
    _mm256_store_pd(out + i + 8, c);
    _mm256_store_pd(out + i + 12, d);
  }
  for (; i < length; i += 4) {
    __m256d a = _mm256_setzero_pd();
    const double* row = rows + i;
    for (uint32_t j = 0; j < count; ++j, row += stride)
      a = _mm256_fmadd_pd(_mm256_broadcast_sd(weights + j), _mm256_load_pd(row), a);
    _mm256_store_pd(out + i, a);
  }
}

__attribute__((target("avx512f"))) void combine_avx512(const double* rows, size_t stride, uint32_t count,
                                                       const double* weights, size_t length, double* out) {
  for (size_t i = 0; i < length; i += 8) {
    __m512d a = _mm512_setzero_pd();
    const double* row = rows + i;
    for (uint32_t j = 0; j < count; ++j, row += stride)
      a = _mm512_fmadd_pd(_mm512_set1_pd(weights[j]), _mm512_load_pd(row), a);
    _mm512_store_pd(out + i, a);
  }
}

__attribute__((target("avx512f"))) void multiply_avx512(const double* matrix, size_t stride,
                                                        uint32_t num_nodes, const double* x, double* y) {
  const size_t n = size_t{3} * num_nodes;
  for (size_t r = 0; r < 3; ++r) memset(y + r * stride, 0, n * sizeof *y);
  for (size_t i = 0; i < n; i += 3) {
    __m512d factors[3][3];
    for (size_t r = 0; r < 3; ++r) {
      for (size_t a = 0; a < 3; ++a) factors[r][a] = _mm512_set1_pd(x[r * stride + i + a]);
    }
    const double* rows = matrix + i * stride;
    for (size_t j = 0; j < n; j += 8) {
      const __m512d row[3] = {_mm512_load_pd(rows + j), _mm512_load_pd(rows + stride + j),
                              _mm512_load_pd(rows + 2 * stride + j)};
      for (size_t r = 0; r < 3; ++r) {
        __m512d sum = _mm512_load_pd(y + r * stride + j);
        for (size_t a = 0; a < 3; ++a) sum = _mm512_fmadd_pd(factors[r][a], row[a], sum);
        _mm512_store_pd(y + r * stride + j, sum);
      }
    }
  }
}

__attribute__((target("avx512f"))) void add_products_avx512(double* matrix, size_t stride, uint32_t num_nodes,
                                                            const double* p, const double* q) {
  const size_t n = size_t{3} * num_nodes;
  for (size_t i = 0; i < n; i += 3) {
    __m512d factors[3][3];
    for (size_t a = 0; a < 3; ++a) {
      for (size_t r = 0; r < 3; ++r) factors[a][r] = _mm512_set1_pd(p[r * stride + i + a]);
    }
    double* rows = matrix + i * stride;
    for (size_t j = 0; j < n; j += 8) {
      const __m512d column[3] = {_mm512_load_pd(q + j), _mm512_load_pd(q + stride + j),
                                 _mm512_load_pd(q + 2 * stride + j)};
      for (size_t a = 0; a < 3; ++a) {
        __m512d sum = _mm512_load_pd(rows + a * stride + j);
        for (size_t r = 0; r < 3; ++r) sum = _mm512_fmadd_pd(factors[a][r], column[r], sum);
        _mm512_store_pd(rows + a * stride + j, sum);
      }
    }
  }
}

#endif

}  // namespace

uint32_t list_inverse_kernels(InverseKernel kernels[kMostInverseKernels]) {
  uint32_t count = 0;
  kernels[count++] = {"scalar", multiply_scalar, add_products_scalar, combine_scalar};
#ifdef PALPATE_X86
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
    kernels[count++] = {"avx2", multiply_avx2, add_products_avx2, combine_avx2};
  if (__builtin_cpu_supports("avx512f"))
    kernels[count++] = {"avx512", multiply_avx512, add_products_avx512, combine_avx512};
#endif
  return count;
}

InverseKernel choose_inverse_kernel() {
  InverseKernel kernels[kMostInverseKernels];
  const uint32_t count = list_inverse_kernels(kernels);
  return kernels[count - 1];
}

}  // namespace palpate
