// linear_dd of one contact alone, at a site or between sites, without any preparation.
//
// A pack holds for each site the nodal forces X = A^-1 E of its patch alone (linear_dd.hpp). A contact with
// the displacement d, at a point with weights w_i of sites i, has
//
//   F = sum_i w_i S_i d,  S_i = E_i^T X_i        u = C f,  f = sum_i w_i X_i d
//
// with f at the nodes of all these patches.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/pack/contact_place.hpp"
#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

struct LinearPointAnswer {
  double energy;        // model units
  double force[3];      // model units
  double stiffness[9];  // by rows, symmetric
};

// Capacity for the held nodes of a contact at a point, with at most three corners.
inline uint32_t most_held_at_point(const pal_pack& pack) {
  return 3 * pack.max_patch_nodes;
}

// Evaluates linear_dd for a finite displacement, model units. Writes the held nodes to `held`, and f times
// pack.metres to `forces`; with a null `held`, neither. Returns the number of nodes written.
uint32_t evaluate_linear_point(const pal_pack& pack, const ContactPlace& place, const double displacement[3],
                               LinearPointAnswer& answer, uint32_t* held, pal_real* forces);

// Returns the Frobenius norm of a site's stiffness alone, for a pack with site_forces; model units.
double patch_stiffness_norm(const pal_pack& pack, uint32_t site);

}  // namespace palpate
