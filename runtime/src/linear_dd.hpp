// linear_dd (EPFE): forces at any contacts from blocks of the inverse stiffness, exact for linear elasticity.
//
// Source: Zhong et al. 2005 eqs. (16)-(21). Held are the nodes H of all contacts and of all run-time-fixed
// ones; with A = K^-1 restricted to H (eq. (17)), nodal forces f and displacements u_H obey u_H = A f, eq.
// (18). A contact moves its patch as one, u_H = E d with d the displacements of the contacts and zero rows at
// fixed nodes (eq. (20)), so
//
//   f = X d,  X = A^-1 E                nodal forces
//   F = E^T f = S d,  S = E^T X         forces of the contacts; S is symmetric
//   u = C f                             everywhere, C the columns of K^-1 that belong to H, eq. (19)
//
// A node held by two contacts follows their mean: its rows of E hold 1/2 for each. X and S change only with
// the set of held nodes; a frame with the same set is two small products.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/arena.hpp"
#include "runtime/src/field_kernel.hpp"
#include "runtime/src/field_snapshot.hpp"

namespace palpate {

// Contacts and fixed nodes, and X and S for them.
struct LinearSet {
  bool ready;  // X and S have been made
  uint32_t num_contacts;
  uint32_t num_held;
  uint32_t fixed_version;  // of the session's fixed nodes
  uint32_t flags;          // PAL_FLAG_OVERLAPPING, PAL_FLAG_ILL_CONDITIONED
  uint32_t* sites;         // [max_contacts]
  uint32_t* held;          // [max_held] contact nodes, first the fixed ones
  double* share;           // [max_held] 1 / number of contacts that hold the node; 0 = fixed
  double* unit_forces;     // X: [3 max_contacts][3 max_held], a row for each column of E
  double* stiffness;       // S: [3 max_contacts][3 max_contacts]
};

// One set answers while another is made ready, if need be over several frames.
struct LinearState {
  // Capacities
  uint32_t max_contacts;
  uint32_t max_held;
  LinearSet answering;
  LinearSet next;
  double* nodal_force;  // f of the last frame: [3 max_held]
  // Making the next one ready
  enum class Phase : uint32_t { gather, factor, solve, sum } phase;
  uint32_t index;        // of the row or column at which the phase is
  uint32_t attempt;      // 0, then with more and more regularisation
  double mean_diagonal;  // of the compliance, from attempt 1 on
  uint32_t* slot_of;     // [num_contact_nodes] position in `next.held` + 1; 0 = not held
  double* factor;        // [3 max_held][3 max_held] upper triangle U, A = U^T U, rows of 3 num_held
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

// Goes on with it for about so many multiply-adds, one row or column (n^2 at most) beyond them, n = 3 x the
// nodes held. Once it is ready it answers, and true is returned. Cost in all: n^3 / 6 + 3 c n^2 for c
// contacts, four times that where A is ill-conditioned.
bool advance_linear(const pal_pack& pack, uint64_t operations, LinearState& state);

// The next set, if it is ready, answers, and the one that did is next.
void swap_sets(LinearState& state);

// Forces [count][3] in model units for displacements in model units [count][3], and f for the field, from the
// set that answers.
void evaluate_linear(const double* displacements, LinearState& state, double* forces);

// The inner loops of making a set ready, on a matrix of their own: what calibration times. `n` rows of
// `matrix`, symmetric and positive definite, are overwritten. Multiply-adds: n^3 / 6.
void factor_for_calibration(double* matrix, uint32_t n);

// u of the nodes of `count` panels from `first` on, added to sum[96 count]. The field's weights are f times
// the length scale. All panels of one held node after one another: the columns of many would be as many
// streams.
void add_linear_field(const pal_pack& pack, const FieldState& field, uint32_t first, uint32_t count,
                      AddColumns add_columns, float* sum);

}  // namespace palpate
