// A compliance compressed within a stated error, for a surface too large for a dense compliance
// (CompressedCompliance in schemas/pack.fbs).
//
// C_Pj are the displacements of a panel's 96 dofs under unit forces at contact node j:
//
//   C_Pj = coefficients            where j is near the panel (rank 96)
//   C_Pj ~ B_P Z_Pj                elsewhere: B_P the first `rank` columns of the panel's basis
//
// So the field is u_P = sum over near j of C_Pj f_j + B_P (sum over far j of Z_Pj f_j). The bracket needs a
// few numbers a held node, and the sum reads the basis once.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/numerics/field_kernel.hpp"
#include "runtime/src/pack/compliance.hpp"
#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

// Capacity of one call of fill_compressed_field.
inline constexpr uint32_t kMostPanelsAtOnce = 32;

inline bool is_compressed(const pal_pack& pack) {
  return pack.compressed_panels != nullptr;
}

// [3][rank] coefficients of a block.
inline const pal_real* block_coefficients(const pal_pack& pack, const pack::CompressedBlock& block) {
  return pack.field_compliance + size_t{block.start} * pack::kBlockUnit;
}

// [num_columns][96] basis of a panel.
inline const pal_real* panel_basis(const pal_pack& pack, uint32_t panel) {
  return pack.compressed_basis + size_t{pack.compressed_panels[panel].first_column} * pack::kPanelRows;
}

// A_ij for i >= j, 3 x 3 by rows. A_ii is symmetric. Cost: 9 rank multiply-adds.
void compressed_contact_compliance(const pal_pack& pack, uint32_t i, uint32_t j, double block[9]);

// sum[96 count] = displacements of `count` panels from `first` on under the nodal forces, in the order of the
// panels' nodes. count <= kMostPanelsAtOnce.
void fill_compressed_field(const pal_pack& pack, const NodalForces& forces, uint32_t first, uint32_t count,
                           AddColumns add_columns, pal_real* sum);

}  // namespace palpate
