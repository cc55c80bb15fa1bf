// The inner loop of every displacement field: one panel of rows as a weighted sum of columns.
#pragma once

#include <palpate/palpate.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "schemas/pack_layout.hpp"

namespace palpate {

// sum[i] = (onto ? sum[i] : 0) + sum over j of weights[j] * columns[j * stride + i], i < pack::kPanelRows.
// Columns are aligned to 64 bytes. Reads count * 96 numbers once; that is what it costs.
using AddColumns = void (*)(const pal_real* columns, size_t stride, const pal_real* weights, uint32_t count,
                            bool onto, pal_real* sum);

// Weights of columns that are int16 (pack::rounded_place): integers, and what one unit of their sum means. The first
// three and the others, which may be much smaller, have a unit each.
struct RoundedWeights {
  uint32_t num_pairs;  // of the others
  pal_real first_unit;
  pal_real unit;                                                         // of them, where there are any
  int16_t weights[3 + 2 * pack::num_column_pairs(3 + pack::kMostRank)];  // [3 + 2 num_pairs]
};

// sum[i] = (onto ? sum[i] : 0) + sum over j < 3 + 2 num_pairs of (j < 3 ? first_unit : unit) * weights[j] *
// columns[pack::rounded_place(j, i)],  i < pack::kPanelRows. The integers of either unit are summed in 32 bits, exactly:
// the caller's weights are small enough. Columns are aligned to 64 bytes.
using AddRounded = void (*)(const int16_t* columns, const RoundedWeights& rounded, bool onto, pal_real* sum);

// sum[i] += sum over j of weights[j] * columns[96 j + i], i < pack::kPanelRows, four at a time: `count` is a multiple
// of that.
using AddBytes = void (*)(const int8_t* columns, const pal_real* weights, uint32_t count, pal_real* sum);

inline void clear_panels(uint32_t count, pal_real* sum) {
  memset(sum, 0, size_t{count} * pack::kPanelRows * sizeof *sum);
}

struct FieldKernel {
  const char* name;
  AddColumns add_columns;
  AddRounded add_rounded;
  AddBytes add_bytes;
};

// Those that this processor runs, the fastest last, and their number: scalar (plain loops; the compiler may vectorise
// them but never contracts a product and a sum), avx2 and avx512 (both fuse them, and give the same bits), avx512vnni
// (avx512 with its instruction for sums of products of int16). They differ from the scalar one by the rounding of
// `count` products at most: |difference| <= count * epsilon * (|sum[i]| + sum over j of |weights[j] columns[j][i]|),
// epsilon that of pal_real, each sum of integers counting as two columns. add_bytes is the same to the bit in all.
inline constexpr uint32_t kMostFieldKernels = 4;
uint32_t list_field_kernels(FieldKernel kernels[kMostFieldKernels]);

// The fastest.
FieldKernel choose_field_kernel();

}  // namespace palpate
