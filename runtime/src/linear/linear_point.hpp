// linear_dd of one contact alone, at a site or at a point between sites: no inverse to make ready.
//
// A pack holds for each site the nodal forces X = A^-1 E of its patch alone (linear_dd.hpp), so that a contact that
// moves by d at a point with the weights w of sites i has
//   F = sum_i w_i S_i d,  S_i = E_i^T X_i        u = C f,  f = sum_i w_i X_i d
// f at the nodes of all their patches.
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

// Nodes that a contact at a point holds at most. Of a place with more corners, as place_answer.hpp has, one patch each.
inline uint32_t most_held_at_point(const pal_pack& pack) {
  return 3 * pack.max_patch_nodes;
}

// For a finite displacement, model units. Leaves the nodes that are held and f, in the pack's metres, at `held` and
// `forces`, and returns how many. Cost: 9 multiply-adds for each node of the patches.
uint32_t evaluate_linear_point(const pal_pack& pack, const ContactPlace& place, const double displacement[3],
                               LinearPointAnswer& answer, uint32_t* held, pal_real* forces);

}  // namespace palpate
