// How the organ outside of the zones follows the contacts from a delivery to the next, to first order:
//
//   u_O(d) = u_O + U (d - d_e),   U = dU_O/dd = -K_OO^-1 K_OB dU_B/dd
//
// d_e: the contact axes of the delivery. K and dU_B/dd are those that the set is prepared with: of the lane's condensation and
// of the first tangents of the groups. With S the blocks of the condensation, the boundary of group h follows an axis by
//
//   dU_h/dd = X_h - K_h^-1 sum of S_hk dU_k/dd over the other groups k,
//
// X_h: the group's own sensitivity to the axis. They also give T and M, by which frames couple groups (zone_balance.hpp).
//
// From one delivery to the next the contact axes move by Dd, and the field by Du. The delivery updates U so that U explains
// the change, U' Dd = Du (Broyden 1965, Math. Comp. 19):
//
//   U' = U + (Du - U Dd) Dd^T / |Dd|^2
//
// With U alone, the error between deliveries is proportional to the way since the set was prepared times the way since the last
// delivery; with the update, to the square of the latter.
#pragma once

#include "runtime/src/exterior/condensation.hpp"
#include "runtime/src/zone/zone_balance.hpp"

namespace palpate {

struct FieldResponse {
  double* columns;  // [axes][num_nodes][3] U
  uint32_t num_contacts;
  uint32_t num_axes;
  uint32_t axis;                   // axes before this one have their dU_B/dd
  uint32_t sweep;                  // sweeps for `axis` that have ended
  double first_change;             // largest change by the first of them
  uint32_t front;                  // this front and the fronts behind it have been passed
  double followed[kMostZoneAxes];  // contact axes where the exterior is
  pal_real* of_packed;  // [axes][field_size()] U of the packed nodes: 1, and m for each radian of a turn
};

void carve_field_response(const pal_pack& pack, const ZoneRoom& room, Arena& arena, FieldResponse& response);

// Begins the response to a prepared set. `is_placed`: the exterior is where the set is, else at rest.
void begin_field_response(const pal_pack& pack, const ZoneSet& set, bool is_placed, FieldResponse& response);

// Advances for about so many multiply-adds and adds the work to `spent`. Returns true once the response is there. `frame`: of
// the prepared set, whose boundary `own` keeps, group by group.
bool advance_field_response(ZoneFrame& frame, const Condensation& own, uint64_t operations,
                            CondensationScratch& scratch, FieldResponse& response, uint64_t& spent);

// Updates U of the packed nodes for a delivery at these contact axes, to which the exterior has moved from `before` to `now`,
// [num_nodes][3]. Leaves U where the contacts have hardly moved, or far.
void update_field_response(const pal_pack& pack, const double* followed, const double* before,
                           const double* now, FieldResponse& response);

}  // namespace palpate
