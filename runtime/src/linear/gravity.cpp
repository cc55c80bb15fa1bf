#include "runtime/src/linear/gravity.hpp"

#include <string.h>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

bool fill_rest(const pal_pack& pack, const FieldKernel& kernel, const pal_real* turn, uint32_t first,
               uint32_t count, pal_real* rows) {
  if (!pack.has_gravity) return false;
  const size_t begin = size_t{first} * pack::kPanelRows;
  const size_t size = size_t{count} * pack::kPanelRows;
  const size_t left = size_t{3} * pack.num_nodes - begin;
  const size_t num_dofs = left < size ? left : size;  // the last panel may be padded
  for (size_t i = 0; i < num_dofs; ++i) {
    const size_t dof = begin + i;
    rows[i] = static_cast<pal_real>((pack.rest_positions[dof] - pack.positions[dof]) * pack.metres);
  }
  memset(rows + num_dofs, 0, (size - num_dofs) * sizeof *rows);
  for (uint32_t panel = 0; panel < count && turn != nullptr; ++panel) {
    kernel.add_columns(pack.field_per_gravity + size_t{3} * (first + panel) * pack::kPanelRows,
                       pack::kPanelRows, turn, 3, true, rows + size_t{panel} * pack::kPanelRows);
  }
  return true;
}

void add_rest(const pal_pack& pack, const pal_real* turn, uint32_t node, pal_real* rows) {
  if (!pack.has_gravity) return;
  for (uint32_t i = 0; i < 3; ++i) {
    const size_t dof = size_t{3} * node + i;
    rows[i] += static_cast<pal_real>((pack.rest_positions[dof] - pack.positions[dof]) * pack.metres);
    for (uint32_t axis = 0; axis < 3 && turn != nullptr; ++axis) {
      rows[i] += turn[axis] * pack.field_per_gravity[(dof / pack::kPanelRows * 3 + axis) * pack::kPanelRows +
                                                     dof % pack::kPanelRows];
    }
  }
}

}  // namespace palpate
