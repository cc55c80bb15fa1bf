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
struct DiagonalBlock {
  float below[kEliminationColumns][kEliminationColumns];
  float inverse[kEliminationColumns];
};

// Factors a diagonal block. Returns false if the block is not positive definite to rounding.
inline bool factor_block(const float* block, uint32_t stride, DiagonalBlock& factor) {
  constexpr float kLeastPivot = 1e-6F;  // of the diagonal entry before this block's elimination
  for (uint32_t c = 0; c < kEliminationColumns; ++c) {
    const float diagonal = block[c * stride + c];
    float pivot = diagonal;
    for (uint32_t k = 0; k < c; ++k) pivot -= factor.below[c][k] * factor.below[c][k];
    if (!(pivot > kLeastPivot * std::fabs(diagonal)) || !isfinite(pivot)) return false;
    factor.inverse[c] = 1.0F / std::sqrt(pivot);
    for (uint32_t r = c + 1; r < kEliminationColumns; ++r) {
      float entry = block[c * stride + r];
      for (uint32_t k = 0; k < c; ++k) entry -= factor.below[r][k] * factor.below[c][k];
      factor.below[r][c] = entry * factor.inverse[c];
    }
  }
  return true;
}

// vector := L^-1 vector, L the diagonal triangle of four columns.
inline void solve_triangle(const float* block, uint32_t stride, double* vector) {
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
