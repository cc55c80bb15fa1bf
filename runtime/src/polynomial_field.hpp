// The displacement field of polynomial_dd: u = L x + B z(x), a linear part and a nonlinear one in a basis of the
// contact site's own (pack.fbs), continued beyond the sampled domain as polynomial_dd.hpp says.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/field_kernel.hpp"
#include "runtime/src/polynomial_dd.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {

// What a field's columns are weighed with: made once for all panels. Lengths in the API's unit.
struct PolynomialWeights {
  const unsigned char* field;  // of the site
  uint64_t panel_bytes;
  uint32_t num_columns;
  pal_real columns[3 + pack::kMostRank];  // x and z
  RoundedWeights rounded;                 // the same where columns are int16; else none
};

// Of the state of a polynomial answer. Rounded weights are wrong by half a unit each: a row by 3 / 2 units of x and
// rank / 2 of z at most, each 1/32767 of the largest or 1/65000 of the sum of such weights. Cost: rank x (terms of
// degree 2 .. degree) multiply-adds, 1,856 at degree 7 and rank 16, 65,000 at degree 14 and rank 96.
void weigh_polynomial(const pal_pack& pack, const PolynomialFieldState& state, PolynomialWeights& weights);

// sum[96 count] = u of the nodes of `count` panels from `first` on, onto what is there or not.
void fill_polynomial_field(const PolynomialWeights& weights, uint32_t first, uint32_t count,
                           const FieldKernel& kernel, bool onto, pal_real* sum);

}  // namespace palpate
