// The displacement field of polynomial_dd: u = L x + B z(x), a linear part and a nonlinear one in a basis of the
// contact site's own (pack.fbs), continued beyond the sampled domain as polynomial_dd.hpp says.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/numerics/basis_combination.hpp"
#include "runtime/src/polynomial/polynomial_dd.hpp"

namespace palpate {

// Of the state of a polynomial answer: x and z, lengths in the API's unit. Rounded weights are wrong by half a unit each:
// a row by 3 / 2 units of x and rank / 2 of z at most, each 1/32767 of the largest or 1/65000 of the sum of such weights.
// Cost: rank x (terms of degree 2 .. degree) multiply-adds, 1,856 at degree 7 and rank 16, 65,000 at degree 14 and rank 96.
void combine_polynomial_basis(const pal_pack& pack, const PolynomialFieldState& state,
                              BasisCombination& columns);

}  // namespace palpate
