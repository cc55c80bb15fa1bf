// Dense elimination of one front of the multifrontal factor.
#pragma once

#include "offline/fem/front_tree.hpp"

namespace palpate {

// Whether a front is cut into blocks, whose work the threads share.
bool is_wide(const Front& front);

// Eliminates the columns of a front: L11 and L21 replace F11 and F21, `update` = - L21 S L21^T. The cuts
// depend on the front's size alone, so the bits do not depend on threads. A null `negative` requires S = 1
// and returns false at the first non-positive pivot; otherwise `negative` receives the signs.
template <typename Real>
bool eliminate_columns(const Front& front, Real* panel, Real* update, char* negative, int threads);

}  // namespace palpate
