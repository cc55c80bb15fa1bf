// The inverse of the compliance of the nodes that are held, kept while nodes come and go.
//
// A is K^-1 restricted to the held nodes, Zhong et al. 2005 eq. (17); it is M = A^-1 that frames need, eq.
// (18), and a node more or less changes it by three columns alone. With a its columns of A at the others, and
// A_nn its own block:
//
//   come:  W = M a,  S = A_nn - a^T W (Schur's complement: its compliance while the others stay where they are)
//          M <- [ M + W S^-1 W^T   -W S^-1 ]
//               [ -S^-1 W^T         S^-1   ]                                        6 n^2 multiply-adds
//   go:    with q its columns of M at the others and s its own block
//          M <- M - q s^-1 q^T                                                      3 n^2
//
// n = 3 x the nodes held. S^-1 = R R^T and s^-1 = R R^T are applied as products of (W R) and (q R) with
// themselves, so that M stays symmetric to the bit.
//
// Rounding would add up over millions of changes. So every few of them one node's columns are set right:
//
//   Y = M A_k - E_k (what is wrong with them),  W = M E_k,  P = Y - W (A_k^T Y) / 2
//   M <- M - P W^T - W P^T          after which M A_k = E_k, to the square of what was wrong    9 n^2
//
// (the symmetric secant update of quasi-Newton methods), each node in its turn. Where Y is more than
// rounding, M is made again from nothing.
//
// A node whose S vanishes to rounding moves as the others already do, and no forces could be told from
// displacements. A soft spring is then added to its own compliance.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/base/arena.hpp"
#include "runtime/src/numerics/inverse_kernel.hpp"

namespace palpate {

struct ContactStiffness {
  InverseKernel kernel;
  uint32_t max_nodes;
  uint32_t num_nodes;
  size_t stride;      // doubles from row to row
  uint32_t* nodes;    // [max_nodes] contact nodes, in no order
  uint32_t* slot_of;  // [num_contact_nodes] place in `nodes` + 1; 0: not held
  bool* regularised;  // [max_nodes]
  uint32_t num_regularised;
  double* matrix;           // M: [3 max_nodes][stride]
  double* columns;          // [3][stride] a, A_k
  double* products;         // [3][stride] W, Y
  double* negated;          // [3][stride]
  uint32_t changes;         // since a node was set right
  uint32_t next_corrected;  // slot
};

// Doubles from row to row.
constexpr size_t inverse_stride(uint32_t max_nodes) {
  return (size_t{3} * max_nodes + kInverseLanes - 1) / kInverseLanes * kInverseLanes;
}

// Takes the arrays; they are all zero. `inverse.kernel` is set by the caller.
void carve_inverse(const pal_pack& pack, uint32_t max_nodes, Arena& arena, ContactStiffness& inverse);

// There is room, and the contact node is not held yet.
void add_node(const pal_pack& pack, uint32_t node, ContactStiffness& inverse);

// The last node takes its slot. False where M is spoilt: nothing is held then.
bool remove_node(uint32_t slot, ContactStiffness& inverse);

void remove_all_nodes(ContactStiffness& inverse);

// Whether a node's columns are to be set right. Springs are no compliance that could be compared with.
inline bool is_correction_due(const ContactStiffness& inverse) {
  constexpr uint32_t kChangesBetween = 4;
  return inverse.changes >= kChangesBetween && inverse.num_nodes > 0 && inverse.num_regularised == 0;
}

// Sets one node's columns right if it is time to. False where they were more wrong than by rounding.
bool correct_inverse(const pal_pack& pack, ContactStiffness& inverse);

// Row of M that belongs to an axis of a held node: 3 num_nodes numbers.
inline const double* inverse_row(const ContactStiffness& inverse, uint32_t slot, uint32_t axis) {
  return inverse.matrix + (size_t{3} * slot + axis) * inverse.stride;
}

}  // namespace palpate
