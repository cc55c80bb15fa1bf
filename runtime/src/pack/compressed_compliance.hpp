// A compliance kept within a stated error, for a surface too large for a dense one (CompressedCompliance in
// schemas/pack.fbs).
//
// With C_Pj the displacements of a panel's 96 dofs for unit forces at contact node j,
//
//   C_Pj = coefficients            where j is near the panel (rank 96)
//   C_Pj ~ B_P Z_Pj                elsewhere: B_P the first `rank` columns of the panel's basis
//
// so the field is u_P = sum over near j of C_Pj f_j + B_P (sum over far j of Z_Pj f_j): the sum in brackets is
// a few numbers for each held node, and the basis is read once whatever their number.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/numerics/field_kernel.hpp"
#include "runtime/src/pack/compliance.hpp"
#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

// Panels whose sums fill_compressed_field makes at once.
inline constexpr uint32_t kMostPanelsAtOnce = 32;

inline bool is_compressed(const pal_pack& pack) {
  return pack.compressed_panels != nullptr;
}

// [3][rank].
inline const pal_real* block_coefficients(const pal_pack& pack, const pack::CompressedBlock& block) {
  return pack.field_compliance + size_t{block.start} * pack::kBlockUnit;
}

// [num_columns][96] of the panel.
inline const pal_real* panel_basis(const pal_pack& pack, uint32_t panel) {
  return pack.compressed_basis + size_t{pack.compressed_panels[panel].first_column} * pack::kPanelRows;
}

// A_ij for i >= j, 3 x 3 by rows; A_ii is symmetric. Cost: 9 rank multiply-adds.
void compressed_contact_compliance(const pal_pack& pack, uint32_t i, uint32_t j, double block[9]);

// sum[96 count] = displacements of `count` panels from `first` on by the nodal forces, in the order
// of the panels' nodes. count <= kMostPanelsAtOnce. Cost: reads a fifth of what a dense compliance would.
void fill_compressed_field(const pal_pack& pack, const NodalForces& forces, uint32_t first, uint32_t count,
                           AddColumns add_columns, pal_real* sum);

}  // namespace palpate
