// Cholesky factorisation U^T U of a small symmetric positive semidefinite matrix. For example, the matrix of
// given forces is singular if contacts share all their nodes.
#pragma once

#include <stdint.h>

namespace palpate {

// Replaces the upper triangle of a matrix [count][count] by U. A pivot below `least_part` of its diagonal
// entry becomes zero, and the function returns false.
bool factor_semidefinite(uint32_t count, double least_part, double* factor);

// x := (U^T U)^-1 x, with zero where the pivot is zero.
void solve_semidefinite(const double* factor, uint32_t count, double* x);

}  // namespace palpate
