// Opening the polynomials of the contact sites: everything that polynomial_dd.cpp and polynomial_field.cpp rely on.
#pragma once

#include <palpate/palpate.h>

#include "schemas/pack_generated.h"

namespace palpate {

// Sets the views of `pack`, whose geometry and sites have been read. False where something is missing, points
// outside its array or says a number from which a frame could make one that is not finite. Cost, unless
// trusted: the arrays are read once.
bool read_polynomial(const pack::PolynomialDd& polynomial, uint64_t first_offset, bool trusted,
                     pal_pack& pack);

}  // namespace palpate
