// A weighted combination of a pack's basis columns, panel by panel.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/numerics/field_kernel.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {

struct BasisCombination {
  const unsigned char* field;  // pack::field_panel_bytes() each panel
  bool is_rounded;             // columns are int16
  uint32_t num_columns;        // at least 3 if columns are int16
  uint32_t num_weighted;       // columns with weights, from the first; the other weights are zero
  pal_real weights[3 + pack::kMostRank];
  RoundedWeights rounded;  // the weights for int16 columns
};

// Rounds `weights` to the integers of `rounded`, for columns in which pack::kBasisUnit is 1. The first three
// weights share a unit, and the other weights share a unit. Each unit is the smallest unit whose sums of
// products fit in 32 bits. The unit is not finite if the weights are not finite.
void round_weights(BasisCombination& columns);

// Writes the weighted sum of `count` panels from `first` on to sum[96 count], or adds the sum if `onto`.
// Cost: one read of the weighted columns.
void fill_columns(const BasisCombination& columns, uint32_t first, uint32_t count, const FieldKernel& kernel,
                  bool onto, pal_real* sum);

}  // namespace palpate
