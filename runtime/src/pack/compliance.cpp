#include "runtime/src/pack/compliance.hpp"

#include <string.h>

#include "runtime/src/numerics/basis_combination.hpp"
#include "runtime/src/pack/compressed_compliance.hpp"
#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

void contact_compliance(const pal_pack& pack, uint32_t i, uint32_t j, double block[9]) {
  double computed[9];
  const double* lower = computed;
  if (pack.contact_compliance != nullptr) {
    lower = pack.contact_compliance + 9 * pack::lower_block(i > j ? i : j, i > j ? j : i);
  } else {
    compressed_contact_compliance(pack, i > j ? i : j, i > j ? j : i, computed);
  }
  for (uint32_t row = 0; row < 3; ++row) {
    for (uint32_t column = 0; column < 3; ++column)
      block[3 * row + column] = i >= j ? lower[3 * row + column] : lower[3 * column + row];
  }
}

// The outer loop runs over held nodes: interleaved columns of many nodes would be too many memory streams.
void fill_compliance_field(const pal_pack& pack, const NodalForces& forces, uint32_t first, uint32_t count,
                           const FieldKernel& kernel, bool onto, pal_real* sum) {
  const uint64_t panels = pack::num_panels(pack.num_nodes);
  BasisCombination columns;
  columns.num_columns = columns.num_weighted = 3;
  columns.is_rounded = false;
  if (forces.count == 0 && !onto) clear_panels(count, sum);
  for (uint32_t slot = 0; slot < forces.count; ++slot, onto = true) {
    const uint32_t node = forces.nodes[slot];
    memcpy(columns.weights, forces.weights + size_t{3} * slot, 3 * sizeof *columns.weights);
    columns.field = reinterpret_cast<const unsigned char*>(pack.field_compliance) +
                    node * panels * pack::field_panel_bytes(3, false);
    fill_columns(columns, first, count, kernel, onto, sum);
  }
}

}  // namespace palpate
