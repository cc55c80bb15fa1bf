// The diagonal block of an elimination, which the scalar kernel and the AVX2 kernel share.
#pragma once

#include <math.h>

#include "runtime/src/numerics/elimination.hpp"

#if defined(__x86_64__) && !defined(PALPATE_SCALAR_ONLY)
#define PALPATE_X86 1
#endif

namespace palpate {

// The Cholesky factor of a diagonal block: L below the diagonal, and the reciprocals of L's diagonal.
struct DiagonalBlock {
  double below[kEliminationColumns][kEliminationColumns];
  double inverse[kEliminationColumns];
};

// False if the block is not positive definite to rounding.
inline bool factor_block(const double* block, uint32_t stride, DiagonalBlock& factor) {
  constexpr double kLeastPivot = 1e-13;  // relative to the diagonal before this block's elimination
  for (uint32_t c = 0; c < kEliminationColumns; ++c) {
    const double diagonal = block[c * stride + c];
    double pivot = diagonal;
    for (uint32_t k = 0; k < c; ++k) pivot -= factor.below[c][k] * factor.below[c][k];
    if (!(pivot > kLeastPivot * fabs(diagonal)) || !isfinite(pivot)) return false;
    factor.inverse[c] = 1.0 / sqrt(pivot);
    for (uint32_t r = c + 1; r < kEliminationColumns; ++r) {
      double entry = block[c * stride + r];
      for (uint32_t k = 0; k < c; ++k) entry -= factor.below[r][k] * factor.below[c][k];
      factor.below[r][c] = entry * factor.inverse[c];
    }
  }
  return true;
}

// Solves with the diagonal triangle of four columns.
inline void solve_triangle(const double* block, uint32_t stride, double* vector) {
  double inverse[kEliminationColumns];  // reciprocals first: no division waits for another division
  for (uint32_t c = 0; c < kEliminationColumns; ++c) inverse[c] = 1.0 / block[c * stride + c];
  for (uint32_t c = 0; c < kEliminationColumns; ++c) {
    double entry = vector[c];
    for (uint32_t k = 0; k < c; ++k) entry -= block[k * stride + c] * vector[k];
    vector[c] = entry * inverse[c];
  }
}

// The AVX2 kernel, for a processor with AVX2 and FMA.
EliminationKernel avx2_elimination_kernel();

}  // namespace palpate
