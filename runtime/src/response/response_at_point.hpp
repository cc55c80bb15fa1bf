// What answers one contact alone at a place between sites: polynomial_dd or linear_dd, blended over the corners with
// the weights of the place. And what moves a zone there.
//
// nonlinear_zone is made about a site s. A contact near it, at a place with the weights w of the corners i, is
// answered by
//
//   f = f_zone,s(d) + sum_i w_i g_i(d) - g_s(d)
//
// g the answer of one contact alone, of polynomial_dd where the pack has it, else of linear_dd; energy, stiffness and
// field likewise. Of several contacts, and where nodes are fixed, g is linear_dd of all of them (linear_blend.hpp) and,
// of one that shares its zone with no other, what polynomial_dd has beyond that of the contact alone. Along a path it
// is continuous but where s changes: there it jumps by what the zone and g differ in from site to site.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/pack/contact_place.hpp"
#include "runtime/src/response/field_snapshot.hpp"

namespace palpate {

// Of the field of a contact by polynomials, or of a zone of so many.
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

// Of a place, or of a difference of two, for a finite displacement. Adds the corners to those of `field`. Cost: that of
// evaluate_polynomial() for each corner.
PointResponse blend_polynomials(const pal_pack& pack, const ContactPlace& place, const double displacement[3],
                                FieldState& field);

// What moves the answer of a zone from `site` to `place`, zero where the place is that site. Adds its field to that
// of the zone. Cost: that of four polynomials, or of linear_dd at a point.
PointResponse move_to_place(const pal_pack& pack, uint32_t site, const ContactPlace& place,
                            const double displacement[3], FieldState& field);

// What of that linear_dd does not have. Nothing of a pack without polynomials. Cost: both.
PointResponse move_beyond_linear(const pal_pack& pack, uint32_t site, const ContactPlace& place,
                                 const double displacement[3], FieldState& field);

}  // namespace palpate
