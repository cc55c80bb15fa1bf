#include "runtime/src/numerics/basis_combination.hpp"

#include <math.h>
#include <string.h>

namespace palpate {
namespace {

// Rounds weights to multiples of a unit. Returns the value of 1 in a sum of products with int16 columns.
pal_real round_some(const pal_real* weights, uint32_t count, int16_t* integers) {
  // The limit keeps each sum of products, with the rounding of 96 weights, below 2^31.
  constexpr pal_real kMostSum = 65000;
  pal_real largest = 0;
  pal_real sum = 0;
  for (uint32_t k = 0; k < count; ++k) {
    const pal_real size = fabs(weights[k]);
    if (size > largest) largest = size;
    sum += size;
  }
  if (!isfinite(sum)) {  // an unverified pack may be damaged: the sum stays non-finite, as without rounding
    memset(integers, 0, count * sizeof *integers);
    return sum;
  }
  const pal_real by_largest = largest / pack::kBasisUnit;
  const pal_real unit = by_largest > sum / kMostSum ? by_largest : sum / kMostSum;
  // Weights below the range of float32 displacements count as zero.
  constexpr pal_real kLeast = pal_real(1e-30);
  const pal_real per_unit = unit > kLeast ? 1 / unit : 0;
  for (uint32_t k = 0; k < count; ++k) {
    const pal_real value = weights[k] * per_unit;
    integers[k] = static_cast<int16_t>(value + (value < 0 ? pal_real(-0.5) : pal_real(0.5)));
  }
  return unit / pack::kBasisUnit;
}

}  // namespace

void round_weights(BasisCombination& columns) {
  RoundedWeights& rounded = columns.rounded;
  const uint32_t others = columns.num_weighted - 3;
  rounded.num_pairs = pack::num_column_pairs(columns.num_weighted);
  rounded.first_unit = round_some(columns.weights, 3, rounded.weights);
  rounded.unit = round_some(columns.weights + 3, others, rounded.weights + 3);
  if (others % 2 != 0) rounded.weights[columns.num_weighted] = 0;
}

void fill_columns(const BasisCombination& columns, uint32_t first, uint32_t count, const FieldKernel& kernel,
                  bool onto, pal_real* sum) {
  const uint64_t panel_bytes = pack::field_panel_bytes(columns.num_columns, columns.is_rounded);
  const unsigned char* panel = columns.field + first * panel_bytes;
  for (uint32_t i = 0; i < count; ++i, panel += panel_bytes, sum += pack::kPanelRows) {
    if (columns.is_rounded) {
      kernel.add_rounded(reinterpret_cast<const int16_t*>(panel), columns.rounded, onto, sum);
    } else {
      kernel.add_columns(reinterpret_cast<const pal_real*>(panel), pack::kPanelRows, columns.weights,
                         columns.num_weighted, onto, sum);
    }
  }
}

}  // namespace palpate
