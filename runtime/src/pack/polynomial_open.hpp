// Opens the polynomials of sites, and checks every assumption of polynomial_dd.cpp and polynomial_field.cpp.
#pragma once

#include <palpate/palpate.h>

#include "schemas/pack_generated.h"

namespace palpate {

// Sets the views of `pack`, whose geometry and sites are ready. Unless trusted, the function reads the arrays
// once. False in three cases:
// - An array is missing.
// - An index or offset points outside its array.
// - A number could make a frame's result non-finite.
bool read_polynomial(const pack::PolynomialDd& polynomial, uint64_t first_offset, bool trusted,
                     pal_pack& pack);

}  // namespace palpate
