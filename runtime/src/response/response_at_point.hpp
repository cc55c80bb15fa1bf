// The response at a point between sites: polynomial_dd or linear_dd, blended with the place's weights over
// its corners. The same blend transfers a zone from its site to a place.
//
// nonlinear_zone has a site s. At a place with the weights w of corners i, a contact near s has the force
//
//   f = f_zone,s(d) + sum_i w_i g_i(d) - g_s(d).
//
// Energy, stiffness and field follow the same formula. g is the answer of one contact alone by polynomial_dd,
// or by linear_dd in a pack without polynomials. Several contacts, or fixed nodes, change g:
// - linear_dd of all contacts (linear_blend.hpp) takes the place of g.
// - A contact alone in its zone adds the difference of polynomial_dd and linear_dd for one contact.
//
// The force is continuous along a path except where s changes.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/pack/contact_place.hpp"
#include "runtime/src/response/field_snapshot.hpp"

namespace palpate {

// Capacity for the corners of a polynomial's field, or of a zone's field with this many contacts.
constexpr uint32_t most_corners(uint32_t num_zone_contacts) {
  return num_zone_contacts > 0 ? kMostCorners * num_zone_contacts : 3;
}

// Model units.
struct PointResponse {
  uint32_t flags;
  double energy;
  double force[3];
  double stiffness[9];  // by rows
};

// The blended response at a place, or at a difference of two places, for a finite displacement. Adds the
// corners to `field`.
PointResponse blend_polynomials(const pal_pack& pack, const ContactPlace& place, const double displacement[3],
                                FieldState& field);

// The transfer of a zone's answer from `site` to `place`: zero if `place` is that site. Adds the transfer's
// field to the zone's field.
PointResponse transfer_to_place(const pal_pack& pack, uint32_t site, const ContactPlace& place,
                                const double displacement[3], FieldState& field);

// transfer_to_place() less its linear_dd part. Zero in a pack without polynomials.
PointResponse transfer_beyond_linear(const pal_pack& pack, uint32_t site, const ContactPlace& place,
                                     const double displacement[3], FieldState& field);

}  // namespace palpate
