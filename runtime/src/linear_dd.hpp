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
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/arena.hpp"
#include "runtime/src/held_inverse.hpp"

namespace palpate {

// Contacts and fixed nodes, and X for them.
struct LinearSet {
  bool ready;  // X has been made
  uint32_t num_contacts;
  uint32_t num_held;
  uint32_t fixed_version;  // of the session's fixed nodes
  uint32_t flags;          // PAL_FLAG_OVERLAPPING, PAL_FLAG_ILL_CONDITIONED
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

// One set answers while another is made ready, if need be over several frames.
struct LinearState {
  // Capacities
  uint32_t max_contacts;
  uint32_t max_held;
  LinearSet answering;
  LinearSet next;
  double* nodal_force;  // f of the last frame: [stride]
  // Making the next one ready
  enum class Phase : uint32_t { remove, add, correct, unit_forces, own_stiffness, gravity } phase;
  uint32_t index;   // of the node, column or row at which the phase is
  bool began_anew;  // the inverse was wrong, and is made again from nothing
  uint32_t num_wanted;
  uint32_t* wanted;     // [max_held] contact nodes that the next set holds
  double* share;        // [max_held] 1 / number of contacts that hold them; 0 = fixed
  uint32_t* wanted_of;  // [num_contact_nodes] place in `wanted` + 1; 0 = not wanted
  HeldInverse inverse;  // of the set that was made ready last, or is on its way to the next
  // Contacts with given forces
  double* given_factor;    // [3 max_contacts][3 max_contacts]
  uint32_t* given_axes;    // [3 max_contacts] of given force, ascending
  double* given_solution;  // [3 max_contacts]
};

// Takes the arrays of a state that serves these capacities.
void carve_linear(const pal_pack& pack, uint32_t max_contacts, uint32_t max_fixed, Arena& arena,
                  LinearState& state);

// Whether a set is, or will be, for these contacts and fixed nodes.
bool is_for(const LinearSet& set, const pal_contact* contacts, uint32_t count, uint32_t fixed_version);

// Begins to make the next set, for these contacts and fixed nodes. `count` and `num_fixed` are within the
// capacities, sites and nodes exist.
void begin_linear(const pal_pack& pack, const pal_contact* contacts, uint32_t count, const uint32_t* fixed,
                  uint32_t num_fixed, uint32_t fixed_version, LinearState& state);

// Goes on with it for about so many multiply-adds, one node (9 n^2 at most) beyond them, n = 3 x the nodes
// held. Once it is ready it answers, and true is returned. Cost in all: 6 n^2 for each node that comes and 3
// n^2 for each that goes, at most that of all to come, 2 n^3 / 3; then n^2 for the sums, and every fourth
// time 9 n^2 to set rounding right.
bool advance_linear(const pal_pack& pack, uint64_t operations, LinearState& state);

// The next set, if it is ready, answers, and the one that did is next.
void swap_sets(LinearState& state);

// What a frame asks of the set that answers, and its answer; model units.
struct LinearFrame {
  const uint32_t*
      given_axes;  // [count] bits 0 to 2: axes along which the force of a contact is given; null: none
  const double* given_forces;  // [count][3] read there
  const double* gravity_turn;  // [3] null: it has not turned
  const double* turn_before;   // [3] null: as gravity_turn
  double* displacements;       // [count][3] filled in where forces are given
  double* forces;              // [count][3]
  double energy;               // W
  double energy_before;        // what W would be with turn_before
  uint32_t flags;              // of what is doubtful about the displacements
};

// Also leaves f for the field in `state`.
void evaluate_linear(const pal_pack& pack, LinearState& state, LinearFrame& frame);

// The 3 x 3 of S of two contacts of a set, by rows; that of the other order is its transpose to the bit.
void contact_stiffness(const pal_pack& pack, const LinearSet& set, uint32_t row, uint32_t column,
                       double block[9]);

}  // namespace palpate
