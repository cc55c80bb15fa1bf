// The contact stiffness M = A^-1, updated while nodes come and go.
//
// A is K^-1 restricted to the held nodes, Zhong et al. 2005 eq. (17). A frame needs M, eq. (18). A node adds
// three columns to M. With a the node's columns of A at the other nodes, and A_nn its own block:
//
//   add:   W = M a,  S = A_nn - a^T W (Schur complement: the node's compliance with the other nodes at rest)
//          M <- [ M + W S^-1 W^T   -W S^-1 ]
//               [ -S^-1 W^T         S^-1   ]                                        6 n^2 multiply-adds
//   remove: with q the node's columns of M at the other nodes and s its own block
//          M <- M - q s^-1 q^T                                                      3 n^2
//
// n = 3 x the nodes held. With S^-1 = R^T R and s^-1 = R^T R, the updates are products of W R^T and q R^T
// with themselves. M thus stays symmetric to the bit.
//
// Rounding adds up over changes. After a few changes a correction restores the columns k of the next node:
//
//   Y = M A_k - E_k (the error),  W = M E_k,  P = Y - W (A_k^T Y) / 2
//   M <- M - P W^T - W P^T          then M A_k = E_k, to second order in the error     9 n^2
//
// This is the symmetric secant update of quasi-Newton methods. If Y exceeds rounding, M is assembled anew.
//
// A node whose S vanishes to rounding moves with the other nodes, so displacements do not determine its
// force. A soft spring then adds to the node's own compliance.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/base/arena.hpp"
#include "runtime/src/numerics/inverse_kernel.hpp"

namespace palpate {

struct ContactStiffness {
  InverseKernel kernel;
  uint32_t max_nodes;
  uint32_t num_nodes;
  size_t stride;      // doubles from row to row of M
  uint32_t* nodes;    // [max_nodes] contact nodes, unsorted
  uint32_t* slot_of;  // [num_contact_nodes] place in `nodes` + 1; 0: not held
  bool* regularised;  // [max_nodes] the node has a spring
  uint32_t num_regularised;
  double* matrix;           // M: [3 max_nodes][stride]
  double* columns;          // [3][stride] scratch: a, A_k
  double* products;         // [3][stride] scratch: W, Y
  double* negated;          // [3][stride] scratch: the negative factor of an update
  uint32_t changes;         // nodes added and removed since the last correction
  uint32_t next_corrected;  // slot of the next correction
};

// Doubles from one row to the next.
constexpr size_t inverse_stride(uint32_t max_nodes) {
  return (size_t{3} * max_nodes + kInverseLanes - 1) / kInverseLanes * kInverseLanes;
}

// Takes the arrays, all zero, from the arena. The caller sets `inverse.kernel`.
void carve_inverse(const pal_pack& pack, uint32_t max_nodes, Arena& arena, ContactStiffness& inverse);

// Adds a contact node. The caller has checked the capacity, and that the node is not held.
void add_node(const pal_pack& pack, uint32_t node, ContactStiffness& inverse);

// Removes a node; the last node takes its slot. Returns false, and empties M, if M has lost its accuracy.
bool remove_node(uint32_t slot, ContactStiffness& inverse);

void remove_all_nodes(ContactStiffness& inverse);

// Whether a correction is due. Springs differ from the compliance, so they allow no correction.
inline bool is_correction_due(const ContactStiffness& inverse) {
  constexpr uint32_t kChangesBetween = 4;
  return inverse.changes >= kChangesBetween && inverse.num_nodes > 0 && inverse.num_regularised == 0;
}

// Corrects one node's columns if a correction is due. Returns false if the error exceeds rounding.
bool correct_inverse(const pal_pack& pack, ContactStiffness& inverse);

// The row of M for an axis of a held node: 3 num_nodes numbers.
inline const double* inverse_row(const ContactStiffness& inverse, uint32_t slot, uint32_t axis) {
  return inverse.matrix + (size_t{3} * slot + axis) * inverse.stride;
}

}  // namespace palpate
