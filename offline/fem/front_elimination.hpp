// Dense elimination of one front of the multifrontal factor.
#pragma once

#include "offline/fem/front_tree.hpp"

namespace palpate {

// Whether a front is cut into blocks, whose work the threads share.
bool is_wide(const Front& front);

// Eliminates the columns of a front. S is diagonal and holds the signs of the pivots, 1 or -1:
//   F11 = L11 S L11^T,   F21 = L21 S L11^T,   update = - L21 S L21^T
//
// Matrices are column-major. F11, L11 and `update` are lower triangles; the function neither reads nor writes
// entries above their diagonals.
//   panel     in, out: num_rows x num_columns. L11 and L21 replace F11 and F21.
//   update    out: num_below x num_below
//   negative  out: num_columns values, 1 where S is -1, else 0. Null requires S = 1.
// Returns false at the first pivot <= 0 if `negative` is null, else at the first 0 or non-finite pivot.
// The blocks depend on the front's size alone, so the bits do not depend on threads.
template <typename Real>
bool eliminate_columns(const Front& front, Real* panel, Real* update, char* negative, int threads);

}  // namespace palpate
