// linear_dd (EPFE): forces at any contacts from blocks of the inverse stiffness, exact for linear elasticity.
//
// Source: Zhong et al. 2005 eqs. (16)-(21). Held are the nodes H of all contacts and of all run-time-fixed
// ones; with A = K^-1 restricted to H (eq. (17)), nodal forces f and displacements u_H obey u_H = A f, eq.
// (18). A contact moves its patch as one, u_H = E d with d the displacements of the contacts and zero rows at
// fixed nodes (eq. (20)), so
//
//   f = X d,  X = A^-1 E                nodal forces
//   F = E^T f = S d,  S = E^T X         forces of the contacts; S is symmetric, and only its blocks on the
//                                       diagonal are kept
//   u = C f                             everywhere, C the columns of K^-1 that belong to H, eq. (19)
//
// A node held by two contacts follows their mean: its rows of E hold 1/2 for each. X changes only with the
// set of held nodes; a frame with the same set is one small product, and sums over the patches.
//
// Along each axis a contact is given its displacement or its force. With P the axes of given force and D the
// others, S_PP d_P = F_P - S_PD d_D, and F = S d as before.
//
// All this is of contacts at sites; linear_blend.hpp has those between them, and what a frame asks.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/base/arena.hpp"
#include "runtime/src/linear/contact_stiffness.hpp"

namespace palpate {

// Contacts at sites and fixed nodes, and X for them.
struct LinearSet {
  bool ready;  // X has been made
  uint32_t num_contacts;
  uint32_t num_held;
  uint32_t fixed_version;  // of the session's fixed nodes
  uint32_t flags;          // PAL_FLAG_OVERLAPPING, PAL_FLAG_ILL_CONDITIONED
  uint64_t last_used;      // LinearState::num_begun then
  uint32_t* sites;         // [max_contacts]
  uint32_t* held;          // [max_held] contact nodes
  uint32_t* patch_slots;   // [max_contacts][max_patch_nodes] where in `held` the nodes of a contact are
  double* patch_shares;    // [max_contacts][max_patch_nodes] and their entries of E; 0: a fixed node
  size_t stride;           // of the rows of X
  double* unit_forces;     // X: [3 max_contacts][stride], a row for each column of E
  double* own_stiffness;   // [max_contacts][3][3] of S
  // Where gravity may turn (gravity.hpp)
  double* gravity_forces;  // Y: [3][3 num_held], a row for each axis of gravity
  double gravity_own[9];   // Z
};

// Takes the arrays of a set of these capacities.
LinearSet carve_set(const pal_pack& pack, uint32_t max_contacts, uint32_t max_held, Arena& arena);

// Makes one set ready at a time, if need be over several frames.
struct LinearAssembly {
  LinearSet* set;
  enum class Phase : uint32_t { remove, add, correct, unit_forces, own_stiffness, gravity } phase;
  uint32_t index;   // of the node, column or row at which the phase is
  bool began_anew;  // the inverse was wrong, and is made again from nothing
  uint32_t num_wanted;
  uint32_t* wanted;          // [max_held] contact nodes that the set holds
  double* share;             // [max_held] 1 / number of contacts that hold them; 0 = fixed
  uint32_t* wanted_of;       // [num_contact_nodes] place in `wanted` + 1; 0 = not wanted
  ContactStiffness inverse;  // of the set that was made ready last, or is on its way to the next
};

void carve_assembly(const pal_pack& pack, uint32_t max_held, Arena& arena, LinearAssembly& assembly);

// Begins to make a set for contacts at these sites and fixed nodes, which all exist and for which it has room.
void begin_set(const pal_pack& pack, const uint32_t* sites, uint32_t count, const uint32_t* fixed,
               uint32_t num_fixed, LinearSet& set, LinearAssembly& assembly);

// Goes on with it until it is ready or for about so many multiply-adds, one node (9 n^2 at most) beyond them, n = 3 x
// the nodes held, and returns how many it took. Cost in all: 6 n^2 for each node that comes and 3 n^2 for each that
// goes, at most that of all to come, 2 n^3 / 3; then n^2 for the sums, and every fourth time 9 n^2 to set rounding
// right.
uint64_t advance_set(const pal_pack& pack, uint64_t operations, LinearAssembly& assembly);

// E^T f of one contact, f at the nodes held.
void sum_patch(const pal_pack& pack, const LinearSet& set, uint32_t contact, const double* nodal_force,
               double force[3]);

// The 3 x 3 of S of two contacts, by rows; that of the other order is its transpose to the bit.
void stiffness_between(const pal_pack& pack, const LinearSet& set, uint32_t row, uint32_t column,
                       double block[9]);

}  // namespace palpate
