// How the organ outside of the zones follows the contacts between two deliveries, to first order:
//
//   u_O(d) = u_O + U (d - d_e),   U = du_O/dd = -K_OO^-1 K_OB du_B/dd
//
// d_e: the contact axes of the delivery. K, S: from the condensation of the prepared set. The boundary of
// group h, with its first tangent K_h and minus its own sensitivity, G_h, follows an axis by
//
//   du_h/dd = G_h - K_h^-1 sum of S_hk du_k/dd over the other groups k
//
// du_B/dd also gives T and M, by which frames couple groups (zone_balance.hpp).
//
// Between two deliveries the axes move by Dd, and the field by Du. The delivery updates U so that U' Dd = Du
// (Broyden 1965, Math. Comp. 19):
//
//   U' = U + (Du - U Dd) Dd^T / |Dd|^2
//
// Without updates, the error is proportional to the product of two distances: since preparation, and since
// the last delivery. With updates, the error is proportional to the square of the second distance.
#pragma once

#include "runtime/src/exterior/condensation.hpp"
#include "runtime/src/zone/zone_balance.hpp"

namespace palpate {

struct FieldResponse {
  double* columns;  // [axes][num_nodes][3] U; before the back substitution du_B/dd alone
  uint32_t num_contacts;
  uint32_t num_axes;
  uint32_t axis;                   // the axes before `axis` have their du_B/dd
  uint32_t sweep;                  // sweeps over the groups for `axis` that have ended
  double first_change;             // largest change of an entry by the first sweep
  uint32_t front;                  // the fronts from this index on are back-substituted
  double followed[kMostZoneAxes];  // d_e of the exterior's displacement; length unit, rad
  pal_real* of_packed;             // [axes][field_size()] U of the packed nodes: m/m, m/rad
};

void carve_field_response(const pal_pack& pack, const ZoneRoom& room, Arena& arena, FieldResponse& response);

// Begins the response of a prepared set. `is_placed`: the exterior is at the set's axes; else at rest.
void begin_field_response(const pal_pack& pack, const ZoneSet& set, bool is_placed, FieldResponse& response);

// Advances until `spent` reaches `operations`, multiply-adds. Returns true at the end. `frame` has the
// prepared set, whose boundary nodes are Condensation::kept, group by group.
bool advance_field_response(ZoneFrame& frame, const Condensation& condensation, uint64_t operations,
                            CondensationScratch& scratch, FieldResponse& response, uint64_t& spent);

// Updates U of the packed nodes for a delivery at the axes `followed`. The exterior moved from `before` to
// `now`, [num_nodes][3]. Leaves U as it is if the contacts have hardly moved, or have moved far.
void update_field_response(const pal_pack& pack, const double* followed, const double* before,
                           const double* now, FieldResponse& response);

}  // namespace palpate
