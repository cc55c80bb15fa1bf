// Columns of a field as a pack has them, panel by panel, and what each weighs.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/numerics/field_kernel.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {

struct BasisCombination {
  const unsigned char* field;  // pack::field_panel_bytes() each panel
  bool is_rounded;             // whether columns are int16
  uint32_t num_columns;        // 3 or more where they are int16
  uint32_t num_weighed;        // the first of them; the others weigh nothing
  pal_real weights[3 + pack::kMostRank];
  RoundedWeights rounded;  // the same of int16
};

// `rounded` := `weights` of columns in which pack::kBasisUnit is 1, the first three and the others each in a unit as
// small as leaves every sum of products in 32 bits; where they are not finite, as a damaged pack makes them, it is not
// either.
void round_weights(BasisCombination& columns);

// sum[96 count] = the weighted sum of `count` panels from `first` on, onto what is there or not. Cost: reads their
// weighed columns once, 2 or sizeof(pal_real) bytes a number.
void fill_columns(const BasisCombination& columns, uint32_t first, uint32_t count, const FieldKernel& kernel,
                  bool onto, pal_real* sum);

}  // namespace palpate
