#include "runtime/src/pack/compressed_open.hpp"

#include <math.h>
#include <string.h>

#include "runtime/src/numerics/binary_search.hpp"
#include "runtime/src/numerics/field_kernel.hpp"
#include "runtime/src/pack/compressed_compliance.hpp"
#include "runtime/src/pack/number_checks.hpp"

namespace palpate {
namespace {

constexpr double kLargestTolerance = 0.1;
constexpr pal_real kLargestBasis = pal_real(1.001);  // 1, with rounding

// Whether every node has a unique place whose panel names the node. Then no frame leaves a node out.
bool are_places_valid(const pal_pack& pack) {
  uint64_t named = 0;
  for (uint32_t p = 0; p < pack.num_panels; ++p) {
    bool ended = false;
    for (const uint32_t node : pack.compressed_panels[p].nodes) {
      ended = ended || node == pack::kNoNode;
      if (ended ? node != pack::kNoNode : node >= pack.num_nodes) return false;
      named += ended ? 0 : 1;
    }
  }
  for (uint32_t node = 0; node < pack.num_nodes; ++node) {
    const uint32_t place = pack.node_places[node];
    if (place / pack::kPanelNodes >= pack.num_panels ||
        pack.compressed_panels[place / pack::kPanelNodes].nodes[place % pack::kPanelNodes] != node)
      return false;
  }
  return named == pack.num_nodes;
}

bool are_blocks_valid(const pal_pack& pack, uint64_t num_coefficients) {
  const pack::CompressedBlock* block = pack.compressed_blocks;
  for (uint32_t node = 0; node < pack.num_contact_nodes; ++node) {
    const uint32_t own_panel = pack.node_places[pack.contact_nodes[node]] / pack::kPanelNodes;
    for (uint32_t p = 0; p < pack.num_panels; ++p, ++block) {
      const bool is_exact = block->rank == pack::kPanelRows;
      if (is_exact) {
        constexpr uint32_t kLineUnits = pack::kAlignment / (pack::kBlockUnit * sizeof(pal_real));
        if (block->start % kLineUnits != 0) return false;
      } else if (p == own_panel || block->rank % pack::kRankStep != 0 ||
                 block->rank > pack.compressed_panels[p].num_columns) {
        return false;
      }
      if (uint64_t{block->start} * pack::kBlockUnit + uint64_t{3} * block->rank > num_coefficients)
        return false;
    }
  }
  return true;
}

// The diagonal of A_jj (compliance.hpp), j the contact node.
void own_compliance(const pal_pack& pack, uint32_t contact_node, double diagonal[3]) {
  double block[9];
  compressed_contact_compliance(pack, contact_node, contact_node, block);
  for (uint32_t axis = 0; axis < 3; ++axis) diagonal[axis] = block[4 * axis];
}

// The index of a packed node in `contact_nodes`, or num_contact_nodes.
uint32_t find_contact(const pal_pack& pack, uint32_t node) {
  return find_sorted(pack.num_contact_nodes, node, [&](uint32_t i) { return pack.contact_nodes[i]; });
}

// The square root of each dof's own compliance in a panel; a large bound for a dof that no tool can touch.
void find_roots(const pal_pack& pack, uint32_t panel, pal_real roots[pack::kPanelRows]) {
  constexpr double kNoBound = 1e50;
  for (uint32_t place = 0; place < pack::kPanelNodes; ++place) {
    const uint32_t node = pack.compressed_panels[panel].nodes[place];
    const uint32_t contact = node == pack::kNoNode ? pack.num_contact_nodes : find_contact(pack, node);
    double diagonal[3] = {kNoBound, kNoBound, kNoBound};
    if (contact < pack.num_contact_nodes) own_compliance(pack, contact, diagonal);
    for (uint32_t axis = 0; axis < 3; ++axis)
      roots[3 * place + axis] = static_cast<pal_real>(sqrt(diagonal[axis]));
  }
}

// Whether |column[row]| <= roots[row] root for all rows. Compares bits, as all_within() does.
bool is_column_within(const pal_real* column, const pal_real* roots, pal_real root) {
  BitsOf<pal_real> differences = 0;
  for (uint32_t row = 0; row < pack::kPanelRows; ++row)
    differences |= bits_of_size(roots[row] * root) - bits_of_size(column[row]);
  return none_below_zero(differences);
}

// Whether the sum of |coefficients| of each axis stays within the limit; basis entries do not exceed 1.
bool is_sum_within(const pal_real* coefficients, uint32_t rank, double limit) {
  for (uint32_t axis = 0; axis < 3; ++axis, coefficients += rank) {
    double sum = 0;
    for (uint32_t k = 0; k < rank; ++k) sum += fabs(static_cast<double>(coefficients[k]));
    if (!(sum <= limit)) return false;
  }
  return true;
}

// A symmetric positive definite compliance has a_ij^2 <= a_ii a_jj. Compression may exceed this bound by its
// tolerance and by rounding.
bool are_numbers_valid(const pal_pack& pack, double tolerance) {
  const AddColumns add_columns = choose_field_kernel().add_columns;
  const double slack = 1.0 + tolerance + 1e-5;
  for (uint32_t panel = 0; panel < pack.num_panels; ++panel) {
    const pack::CompressedPanel& stored = pack.compressed_panels[panel];
    const pal_real* basis = panel_basis(pack, panel);
    if (!all_within(basis, size_t{stored.num_columns} * pack::kPanelRows, kLargestBasis)) return false;
    pal_real roots[pack::kPanelRows];
    find_roots(pack, panel, roots);
    for (uint32_t node = 0; node < pack.num_contact_nodes; ++node) {
      const pack::CompressedBlock& block = pack.compressed_blocks[size_t{node} * pack.num_panels + panel];
      const pal_real* coefficients = block_coefficients(pack, block);
      double diagonal[3];
      own_compliance(pack, node, diagonal);
      double largest = 0;
      for (const double entry : diagonal) {
        if (!is_own_compliance(pack, entry)) return false;
        largest = entry > largest ? entry : largest;
      }
      const double limit = kLargestAmplification * largest;
      if (block.rank == pack::kPanelRows
              ? !all_within(coefficients, size_t{3} * block.rank, static_cast<pal_real>(limit))
              : !is_sum_within(coefficients, block.rank, limit))
        return false;
      for (uint32_t axis = 0; axis < 3; ++axis) {
        const pal_real* column = coefficients + size_t{axis} * block.rank;
        alignas(64) pal_real expanded[pack::kPanelRows];
        if (block.rank != pack::kPanelRows) {
          add_columns(basis, pack::kPanelRows, column, block.rank, false, expanded);
          column = expanded;
        }
        if (!is_column_within(column, roots, static_cast<pal_real>(slack * sqrt(diagonal[axis]))))
          return false;
      }
    }
  }
  return true;
}

}  // namespace

bool read_compressed(const pack::CompressedCompliance& compressed, uint64_t first_offset, bool trusted,
                     pal_pack& pack) {
  pack.num_panels = compressed.num_panels();
  // Every panel has a node, so that places stay below 2^32.
  if (pack.num_panels == 0 || pack.num_panels > pack.num_nodes) return false;
  pack.compressed_panels =
      array_of<pack::CompressedPanel>(pack, compressed.panels(), first_offset, pack.num_panels);
  pack.node_places = array_of<uint32_t>(pack, compressed.node_places(), first_offset, pack.num_nodes);
  if (pack.compressed_panels == nullptr || pack.node_places == nullptr || !are_places_valid(pack))
    return false;
  uint64_t num_columns = 0;
  for (uint32_t p = 0; p < pack.num_panels; ++p) {
    const pack::CompressedPanel& panel = pack.compressed_panels[p];
    if (panel.first_column != num_columns || panel.num_columns > pack::kPanelRows) return false;
    num_columns += panel.num_columns;
  }
  pack.compressed_basis =
      array_of<pal_real>(pack, compressed.basis(), first_offset, num_columns * pack::kPanelRows);
  pack.compressed_blocks = array_of<pack::CompressedBlock>(
      pack, compressed.blocks(), first_offset, uint64_t{pack.num_contact_nodes} * pack.num_panels);
  // The blocks determine the number of coefficients.
  const uint64_t num_coefficients =
      compressed.coefficients() == nullptr ? 0 : compressed.coefficients()->bytes() / sizeof(pal_real);
  pack.field_compliance = array_of<pal_real>(pack, compressed.coefficients(), first_offset, num_coefficients);
  if (pack.compressed_basis == nullptr || pack.compressed_blocks == nullptr ||
      pack.field_compliance == nullptr || !are_blocks_valid(pack, num_coefficients)) {
    return false;
  }
  const auto is_part = [](double value, double most) { return value >= 0 && value <= most; };
  if (!is_part(compressed.tolerance(), kLargestTolerance) ||
      !is_part(compressed.displacement_error(), kLargestEnergy) ||
      !is_part(compressed.force_error(), kLargestEnergy)) {
    return false;
  }
  return trusted || are_numbers_valid(pack, compressed.tolerance());
}

}  // namespace palpate
