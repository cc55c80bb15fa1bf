#include "runtime/src/pack/compressed_compliance.hpp"

#include <string.h>

namespace palpate {

void compressed_contact_compliance(const pal_pack& pack, uint32_t i, uint32_t j, double block[9]) {
  const uint32_t place = pack.node_places[pack.contact_nodes[i]];
  const uint32_t panel = place / pack::kPanelNodes;
  const uint32_t row = 3 * (place % pack::kPanelNodes);
  const pack::CompressedBlock& stored = pack.compressed_blocks[size_t{j} * pack.num_panels + panel];
  const pal_real* coefficients = block_coefficients(pack, stored);
  if (stored.rank == pack::kPanelRows) {
    for (uint32_t r = 0; r < 3; ++r) {
      for (uint32_t c = 0; c < 3; ++c) {
        // A diagonal block stores both halves, which differ by rounding. The lower half alone is used.
        const bool other_half = i == j && r < c;
        block[3 * r + c] = other_half ? static_cast<double>(coefficients[pack::kPanelRows * r + row + c])
                                      : static_cast<double>(coefficients[pack::kPanelRows * c + row + r]);
      }
    }
    return;
  }
  const pal_real* basis = panel_basis(pack, panel) + row;
  double sums[9] = {};
  for (uint32_t k = 0; k < stored.rank; ++k, basis += pack::kPanelRows) {
    for (uint32_t c = 0; c < 3; ++c) {
      const auto weight = static_cast<double>(coefficients[c * stored.rank + k]);
      for (uint32_t r = 0; r < 3; ++r) sums[3 * r + c] += static_cast<double>(basis[r]) * weight;
    }
  }
  memcpy(block, sums, sizeof sums);
}

// The outer loop runs over held nodes, in the order of their coefficients.
void fill_compressed_field(const pal_pack& pack, const NodalForces& forces, uint32_t first, uint32_t count,
                           AddColumns add_columns, pal_real* sum) {
  alignas(64) pal_real modes[kMostPanelsAtOnce * pack::kPanelRows];
  uint32_t num_modes[kMostPanelsAtOnce];  // modes of each panel so far
  clear_panels(count, sum);
  memset(modes, 0, size_t{count} * pack::kPanelRows * sizeof *modes);
  memset(num_modes, 0, count * sizeof *num_modes);
  for (uint32_t slot = 0; slot < forces.count; ++slot) {
    const pack::CompressedBlock* blocks =
        pack.compressed_blocks + size_t{forces.nodes[slot]} * pack.num_panels + first;
    const pal_real* force = forces.weights + size_t{3} * slot;
    for (uint32_t panel = 0; panel < count; ++panel) {
      const uint32_t rank = blocks[panel].rank;
      const pal_real* coefficients = block_coefficients(pack, blocks[panel]);
      if (rank == pack::kPanelRows) {
        pal_real* rows = sum + size_t{panel} * pack::kPanelRows;
        add_columns(coefficients, pack::kPanelRows, force, 3, true, rows);
        continue;
      }
      pal_real* panel_modes = modes + size_t{panel} * pack::kPanelRows;
      for (uint32_t k = 0; k < rank; ++k)
        panel_modes[k] += force[0] * coefficients[k] + force[1] * coefficients[rank + k] +
                          force[2] * coefficients[2 * rank + k];
      if (rank > num_modes[panel]) num_modes[panel] = rank;
    }
  }
  for (uint32_t panel = 0; panel < count; ++panel) {
    pal_real* rows = sum + size_t{panel} * pack::kPanelRows;
    add_columns(panel_basis(pack, first + panel), pack::kPanelRows, modes + size_t{panel} * pack::kPanelRows,
                num_modes[panel], true, rows);
  }
}

}  // namespace palpate
