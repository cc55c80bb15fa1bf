// The inner loop of every displacement field: one panel of rows as a weighted sum of columns.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "schemas/pack_layout.hpp"

namespace palpate {

// sum[i] += sum over j of weights[j] * columns[j * stride + i], i < pack::kPanelRows. Columns are aligned to
// 64 bytes. Reads count * 384 bytes once; that is what it costs.
using AddColumns = void (*)(const float* columns, size_t stride, const float* weights, uint32_t count,
                            float* sum);

// Plain loops; the compiler may vectorise them but never contracts a product and a sum.
void add_columns_scalar(const float* columns, size_t stride, const float* weights, uint32_t count,
                        float* sum);

// The fastest kernel that this processor runs. Differs from the scalar one by the rounding of `count`
// products at most: |difference| <= count * 2^-23 * (|sum[i]| + sum over j of |weights[j] columns[j][i]|).
AddColumns choose_add_columns();

}  // namespace palpate
