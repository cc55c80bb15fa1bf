// The displacement field of polynomial_dd: u = L x + B z(x), with a linear part L and a basis B of the site's
// own (pack.fbs). polynomial_dd.hpp states the field outside the sampled domain.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/numerics/basis_combination.hpp"
#include "runtime/src/polynomial/polynomial_dd.hpp"

namespace palpate {

// Fills in the weights x and z of the site's columns, lengths in the API's unit. Rounding errs by half a unit
// a weight: at most 3/2 units of x and rank/2 units of z in a row. Cost: rank x (terms of degree 2 .. degree)
// multiply-adds.
void combine_polynomial_basis(const pal_pack& pack, const PolynomialFieldState& state,
                              BasisCombination& columns);

}  // namespace palpate
