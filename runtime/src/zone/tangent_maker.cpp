#include "runtime/src/zone/tangent_maker.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

namespace palpate {
namespace {

// Relative increases of the diagonal, tried in turn until K_uu is positive definite.
constexpr float kShifts[] = {0.0F, 0.1F, 1.0F};
constexpr uint32_t kNumShifts = 3;
// Multiply-adds that take as long as clearing one uncached entry of a column.
constexpr uint64_t kOperationsPerEntry = 8;
constexpr uint32_t kRowsAtOnce = 3;  // sensitivities for each pass over the matrix; divides num_axes

// Clears a column and writes S to the rows and columns of boundary nodes.
void begin_column(const GroupLayout& layout, const float* exterior, uint32_t column, float* matrix) {
  const size_t stride = layout.stride;
  float* to = matrix + column * stride;
  const size_t top = column / kEliminationRows * kEliminationRows;
  memset(to + top, 0, (stride - top) * sizeof *to);
  const uint32_t first = 3 * layout.num_interior;
  if (column < first || column >= first + 3 * layout.num_boundary) return;
  const uint32_t j = column - first;
  memcpy(to + column, exterior + size_t{j} * layout.boundary_stride + j,
         (3 * layout.num_boundary - j) * sizeof *to);
}

void finish_assembly(const TangentSource& source, float shift, float* matrix) {
  const GroupLayout& layout = source.layout;
  const size_t stride = layout.stride;
  const uint32_t free = layout.num_interior + layout.num_boundary;
  for (uint32_t i = 3 * free; i < layout.unknowns; ++i) matrix[i * stride + i] = 1;
  for (uint32_t i = 0; i < free; ++i) {
    const uint32_t axes = moving_axes(source.pack, source.members, layout.first_node + i);
    for (uint32_t axis = 0; axis < 3 && axes != 7; ++axis) {
      if ((axes >> axis & 1) == 0) drop_unknown(3 * i + axis, layout.size, layout.stride, matrix);
    }
  }
  for (uint32_t i = 0; i < layout.unknowns && shift > 0; ++i) matrix[i * stride + i] *= 1 + shift;
}

// Computes the next kRowsAtOnce sensitivities, X L^-1.
void substitute_rows(const TangentSource& source, const float* matrix, double* rows, TangentMaker& maker) {
  const GroupLayout& layout = source.layout;
  double* to = rows + size_t{maker.substituted} * layout.unknowns;
  for (uint32_t column = 0; column < layout.unknowns; ++column) {
    const float* from = matrix + size_t{column} * layout.stride + layout.unknowns + maker.substituted;
    for (uint32_t t = 0; t < kRowsAtOnce; ++t)
      to[size_t{t} * layout.unknowns + column] = static_cast<double>(from[t]);
  }
  source.kernel.back_substitute(matrix, layout.stride, layout.unknowns, to, layout.unknowns, kRowsAtOnce);
  maker.substituted += kRowsAtOnce;
}

bool is_stiffness_finite(const GroupLayout& layout, const float* matrix) {
  const float* trailing = matrix + size_t{layout.unknowns} * layout.stride + layout.unknowns;
  for (uint32_t j = 0; j < layout.num_axes; ++j) {
    for (uint32_t i = j; i < layout.num_axes; ++i) {
      if (!isfinite(trailing[size_t{j} * layout.stride + i])) return false;
    }
  }
  return true;
}

}  // namespace

Progress advance_tangent(const TangentSource& source, uint64_t operations, float* matrix, double* rows,
                         TangentMaker& maker, uint64_t& spent) {
  const GroupLayout& layout = source.layout;
  const uint32_t columns = round_to_columns(layout.size);
  for (; spent < operations && maker.columns < columns; spent += kOperationsPerEntry * layout.size)
    begin_column(layout, source.exterior, maker.columns++, matrix);
  while (spent < operations && maker.parts < source.num_parts)
    spent += source.add_part(source.elements, maker.parts++, matrix);
  if (spent >= operations) return Progress::goes_on;
  if (!maker.is_assembled) finish_assembly(source, kShifts[maker.shift], matrix);
  maker.is_assembled = true;
  for (; spent < operations && maker.eliminated < layout.size; maker.eliminated += kEliminationColumns) {
    spent += elimination_operations(layout.size, layout.unknowns, maker.eliminated);
    if (source.kernel.eliminate_columns(matrix, layout.stride, layout.size, layout.unknowns,
                                        maker.eliminated))
      continue;
    const uint32_t shift = maker.shift + 1;
    maker = {};
    maker.shift = shift;
    return shift < kNumShifts ? Progress::goes_on : Progress::failed;
  }
  for (; spent < operations && maker.substituted < layout.num_axes;
       spent += uint64_t{layout.unknowns} * layout.unknowns)
    substitute_rows(source, matrix, rows, maker);
  if (maker.substituted < layout.num_axes) return Progress::goes_on;
  return is_stiffness_finite(layout, matrix) ? Progress::ended : Progress::failed;
}

}  // namespace palpate
