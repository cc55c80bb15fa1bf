// The small systems of given forces: Cholesky's factor U^T U of a symmetric matrix that may be singular, as of contacts
// that hold the same nodes.
#pragma once

#include <stdint.h>

namespace palpate {

// In place of the upper triangle of a matrix [count][count]. An axis of which no more than this part is left, as of a
// contact wholly on fixed nodes, gets no entry: false.
bool factor_given(uint32_t count, double least_part, double* factor);

// x := (U^T U)^-1 x, zero where there is no pivot.
void solve_given(const double* factor, uint32_t count, double* x);

}  // namespace palpate
