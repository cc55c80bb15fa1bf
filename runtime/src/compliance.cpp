#include "runtime/src/compliance.hpp"

#include "runtime/src/compressed_compliance.hpp"
#include "runtime/src/pack_view.hpp"

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

// All panels of one held node after one another: the columns of many would be as many streams.
void fill_compliance_field(const pal_pack& pack, const NodalForces& forces, uint32_t first, uint32_t count,
                           AddColumns add_columns, bool onto, pal_real* sum) {
  constexpr size_t kColumns = size_t{3} * pack::kPanelRows;
  const size_t panels = pack::num_panels(pack.num_nodes);
  if (forces.count == 0 && !onto) clear_panels(count, sum);
  for (uint32_t slot = 0; slot < forces.count; ++slot, onto = true) {
    const uint32_t node = forces.nodes[slot];
    const pal_real* all =
        node < pack.num_contact_nodes
            ? pack.field_compliance + node * panels * kColumns
            : pack.zone_field_compliance + (node - pack.num_contact_nodes) * panels * kColumns;
    const pal_real* columns = all + first * kColumns;
    for (uint32_t panel = 0; panel < count; ++panel) {
      add_columns(columns + panel * kColumns, pack::kPanelRows, forces.weights + size_t{3} * slot, 3, onto,
                  sum + size_t{panel} * pack::kPanelRows);
    }
  }
}

}  // namespace palpate
