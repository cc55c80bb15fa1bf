// The diagonal block of an elimination, which the scalar kernel and the AVX2 kernel share.
#pragma once

#include <math.h>

#include <cmath>

#include "runtime/src/numerics/elimination.hpp"

#if defined(__x86_64__) && !defined(PALPATE_SCALAR_ONLY)
#define PALPATE_X86 1
#endif

namespace palpate {

// The Cholesky factor of a diagonal block: L below the diagonal, and the reciprocals of L's diagonal.
template <typename Number>
struct DiagonalBlock {
  Number below[kEliminationColumns][kEliminationColumns];
  Number inverse[kEliminationColumns];
};

// False if the block is not positive definite to rounding.
template <typename Number>
inline bool factor_block(const Number* block, uint32_t stride, DiagonalBlock<Number>& factor) {
  // Relative to the diagonal before this block's elimination
  constexpr Number kLeastPivot = sizeof(Number) == sizeof(double) ? Number(1e-13) : Number(1e-6);
  for (uint32_t c = 0; c < kEliminationColumns; ++c) {
    const Number diagonal = block[c * stride + c];
    Number pivot = diagonal;
    for (uint32_t k = 0; k < c; ++k) pivot -= factor.below[c][k] * factor.below[c][k];
    if (!(pivot > kLeastPivot * std::fabs(diagonal)) || !isfinite(pivot)) return false;
    factor.inverse[c] = Number(1) / std::sqrt(pivot);
    for (uint32_t r = c + 1; r < kEliminationColumns; ++r) {
      Number entry = block[c * stride + r];
      for (uint32_t k = 0; k < c; ++k) entry -= factor.below[r][k] * factor.below[c][k];
      factor.below[r][c] = entry * factor.inverse[c];
    }
  }
  return true;
}

// Solves with the diagonal triangle of four columns.
template <typename Number>
inline void solve_triangle(const Number* block, uint32_t stride, double* vector) {
  double inverse[kEliminationColumns];  // reciprocals first: no division waits for another division
  for (uint32_t c = 0; c < kEliminationColumns; ++c)
    inverse[c] = 1.0 / static_cast<double>(block[c * stride + c]);
  for (uint32_t c = 0; c < kEliminationColumns; ++c) {
    double entry = vector[c];
    for (uint32_t k = 0; k < c; ++k) entry -= static_cast<double>(block[k * stride + c]) * vector[k];
    vector[c] = entry * inverse[c];
  }
}

// The AVX2 kernel, for a processor with AVX2 and FMA.
EliminationKernel avx2_elimination_kernel();

}  // namespace palpate
