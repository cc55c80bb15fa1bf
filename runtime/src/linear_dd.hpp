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

struct LinearState {
  // Capacities
  uint32_t max_contacts;
  uint32_t max_held;
  // The set at hand
  uint32_t num_contacts;
  uint32_t num_held;
  bool valid;           // X and S belong to `sites` and the fixed nodes
  uint32_t flags;       // PAL_FLAG_OVERLAPPING, PAL_FLAG_ILL_CONDITIONED
  uint32_t* sites;      // [max_contacts]
  uint32_t* held;       // [max_held] contact nodes, first the fixed ones
  uint32_t* slot_of;    // [num_contact_nodes] position in `held` + 1; 0 = not held
  double* share;        // [max_held] 1 / number of contacts that hold the node; 0 = fixed
  double* factor;       // [3 max_held][3 max_held] upper triangle U, A = U^T U, rows of 3 num_held
  double* unit_forces;  // X: [3 max_contacts][3 max_held], a row for each column of E
  double* stiffness;    // S: [3 max_contacts][3 max_contacts]
  double* nodal_force;  // f of the last frame: [3 max_held]
};

// Takes the arrays of a state that serves these capacities.
void carve_linear(const pal_pack& pack, uint32_t max_contacts, uint32_t max_fixed, Arena& arena,
                  LinearState& state);

// Makes X and S for these contacts and fixed nodes. `count` and `num_fixed` are within the capacities, sites
// and nodes exist. Cost: 9 n^3 for n held nodes (a factor, and 3 back-solves a contact).
void prepare_linear(const pal_pack& pack, const pal_contact* contacts, uint32_t count, const uint32_t* fixed,
                    uint32_t num_fixed, LinearState& state);

// Forces [count][3] in model units for displacements in model units [count][3], and f for the field.
void evaluate_linear(const double* displacements, LinearState& state, double* forces);

// u of the nodes of one panel, added to sum[96]. The field's weights are f times the length scale.
void add_linear_field(const pal_pack& pack, const FieldState& field, uint32_t panel, AddColumns add_columns,
                      float* sum);

}  // namespace palpate
