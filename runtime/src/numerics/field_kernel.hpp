// The inner loop of every displacement field: a panel of rows as a weighted sum of columns.
#pragma once

#include <palpate/palpate.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "schemas/pack_layout.hpp"

namespace palpate {

// sum[i] = (onto ? sum[i] : 0) + sum over j of weights[j] * columns[j * stride + i], i < pack::kPanelRows.
// Columns are aligned to 64 bytes. Cost: one read of count * 96 numbers.
using AddColumns = void (*)(const pal_real* columns, size_t stride, const pal_real* weights, uint32_t count,
                            bool onto, pal_real* sum);

// Integer weights for int16 columns (pack::rounded_place). The first three weights have a unit of their own,
// because the other weights may be much smaller.
struct RoundedWeights {
  uint32_t num_pairs;   // pairs of columns after the first three
  pal_real first_unit;  // value of 1 in the sums of the first three columns
  pal_real unit;        // value of 1 in the sums of the other columns
  int16_t weights[3 + 2 * pack::num_column_pairs(3 + pack::kMostRank)];  // [3 + 2 num_pairs]
};

// sum[i] = (onto ? sum[i] : 0) + sum over j < 3 + 2 num_pairs of (j < 3 ? first_unit : unit) * weights[j] *
// columns[pack::rounded_place(j, i)], i < pack::kPanelRows. The 32-bit integer sums are exact for
// the weights of round_weights(). Columns are aligned to 64 bytes.
using AddRounded = void (*)(const int16_t* columns, const RoundedWeights& rounded, bool onto, pal_real* sum);

inline void clear_panels(uint32_t count, pal_real* sum) {
  memset(sum, 0, size_t{count} * pack::kPanelRows * sizeof *sum);
}

struct FieldKernel {
  const char* name;
  AddColumns add_columns;
  AddRounded add_rounded;
};

// Lists the kernels that this processor can run, the fastest last. Returns their number.
// - scalar: plain loops. The compiler may vectorise them but never fuses a product and a sum.
// - avx2 and avx512 fuse products and sums, and give the same bits.
// - avx512vnni is avx512 with the instruction for sums of int16 products.
//
// Kernels differ by the rounding of `count` products at most: |difference| <= count * epsilon * (|sum[i]| +
// sum over j of |weights[j] columns[j][i]|), epsilon of pal_real. Each integer sum counts as two columns.
inline constexpr uint32_t kMostFieldKernels = 4;
uint32_t list_field_kernels(FieldKernel kernels[kMostFieldKernels]);

FieldKernel choose_field_kernel();

}  // namespace palpate
