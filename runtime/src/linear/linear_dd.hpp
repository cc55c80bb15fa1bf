// linear_dd (EPFE): forces at any contacts from blocks of the inverse stiffness, exact for linear elasticity.
//
// Source: Zhong et al. 2005 eqs. (16)-(21). H are the held nodes: the nodes of all contacts and the nodes
// fixed at run time. With A = K^-1 restricted to H (eq. (17)), nodal forces f and displacements u_H obey u_H
// = A f, eq. (18). A contact moves its patch as a rigid body, u_H = E d, with d the displacements of the
// contacts and zero rows at fixed nodes (eq. (20)). So
//
//   f = X d,  X = A^-1 E                nodal forces
//   F = E^T f = S d,  S = E^T X         forces of the contacts; S is symmetric
//   u = C f                             displacements, C the columns of K^-1 for H, eq. (19)
//
// A node of two contacts follows their mean: its rows of E hold 1/2 for each contact. X changes only with H,
// so a frame with the same H is one small product and sums over the patches.
//
// Along each axis a contact has a given displacement or a given force. With P the axes of given force and D
// the other axes, S_PP d_P = F_P - S_PD d_D, and F = S d.
//
// This file treats contacts at sites. linear_blend.hpp treats contacts between sites.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/base/arena.hpp"
#include "runtime/src/linear/contact_stiffness.hpp"

namespace palpate {

// Contacts at sites, fixed nodes, and their X.
struct LinearSet {
  bool ready;  // X is complete
  uint32_t num_contacts;
  uint32_t num_held;
  uint32_t fixed_version;  // version of the session's fixed nodes
  uint32_t flags;          // PAL_FLAG_OVERLAPPING, PAL_FLAG_ILL_CONDITIONED
  uint64_t last_used;      // LinearState::num_begun at the last use
  uint32_t* sites;         // [max_contacts]
  uint32_t* held;          // [max_held] contact nodes
  uint32_t* patch_slots;   // [max_contacts][max_patch_nodes] places of a contact's nodes in `held`
  double* patch_shares;    // [max_contacts][max_patch_nodes] entries of E; 0: a fixed node
  size_t stride;           // doubles from one row of X to the next
  double* unit_forces;     // X: [3 max_contacts][stride], a row for each column of E
  double* own_stiffness;   // [max_contacts][3][3] diagonal blocks of S
  // For turned gravity (gravity.hpp):
  double* gravity_forces;  // Y: [3][3 num_held], a row for each axis of gravity
  double gravity_own[9];   // Z
};

// Takes the arrays for these capacities from the arena.
LinearSet carve_set(const pal_pack& pack, uint32_t max_contacts, uint32_t max_held, Arena& arena);

// Assembles one set at a time, over several frames if needed.
struct LinearAssembly {
  LinearSet* set;
  enum class Phase : uint32_t { remove, add, correct, unit_forces, own_stiffness, gravity } phase;
  uint32_t index;   // node, column or row of the current phase
  bool began_anew;  // M began without nodes, so a failed correction is accepted
  uint32_t num_wanted;
  uint32_t* wanted;          // [max_held] contact nodes of the set
  double* share;             // [max_held] 1 / number of contacts that hold the node; 0: fixed
  uint32_t* wanted_of;       // [num_contact_nodes] place in `wanted` + 1; 0: not wanted
  ContactStiffness inverse;  // M of the last set, or between the last set and `set`
};

void carve_assembly(const pal_pack& pack, uint32_t max_held, Arena& arena, LinearAssembly& assembly);

// Begins a set for contacts at these sites and for these fixed nodes. The caller has checked the capacities.
void begin_set(const pal_pack& pack, const uint32_t* sites, uint32_t count, const uint32_t* fixed,
               uint32_t num_fixed, LinearSet& set, LinearAssembly& assembly);

// Advances the set until it is ready, or by about `operations` multiply-adds. The last step may exceed them
// by 9 n^2, with n = 3 x the nodes held. Returns the multiply-adds spent. Total, at most that of a new
// assembly, 2 n^3 / 3:
// - 6 n^2 for each node that comes, and 3 n^2 for each node that leaves,
// - n^2 for the sums,
// - 9 n^2 for a correction of rounding, if at least four nodes have come or left since the last correction.
uint64_t advance_set(const pal_pack& pack, uint64_t operations, LinearAssembly& assembly);

// Computes E^T f of one contact, f at the nodes held.
void sum_patch(const pal_pack& pack, const LinearSet& set, uint32_t contact, const double* nodal_force,
               double force[3]);

// Computes the block of S for two contacts, by rows. The block of (column, row) is its transpose to the bit.
void stiffness_between(const pal_pack& pack, const LinearSet& set, uint32_t row, uint32_t column,
                       double block[9]);

}  // namespace palpate
