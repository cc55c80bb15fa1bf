// How the organ outside of the zones follows the contacts from a delivery to the next, to first order:
//
//   u_O(d) = u_O + U (d - d_e),   U = dU_O/dd = -K_OO^-1 K_OB dU_B/dd
//
// d_e: the contact axes of the delivery. K and dU_B/dd are those that the set is prepared with: of the lane's condensation and
// of the first tangents of the groups. The boundaries of the other groups are taken to stand still.
#pragma once

#include "runtime/src/zone/condensation.hpp"
#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

struct FieldResponse {
  double* columns;  // [axes][num_nodes][3] U
  uint32_t num_axes;
  uint32_t front;       // this front and the fronts behind it have been passed
  pal_real* of_packed;  // [axes][field_size()] U of the packed nodes: 1, and m for each radian of a turn
};

void carve_field_response(const pal_pack& pack, const ZoneRoom& room, Arena& arena, FieldResponse& response);

// Begins the response to a prepared set, whose boundary `own` keeps, group by group.
void begin_field_response(const pal_pack& pack, const ZoneSet& set, const Condensation& own,
                          FieldResponse& response);

// Advances for about so many multiply-adds and adds the work to `spent`. Returns true once the response is there.
bool advance_field_response(const pal_pack& pack, const EliminationKernel& kernel, const Condensation& own,
                            uint64_t operations, CondensationScratch& scratch, FieldResponse& response,
                            uint64_t& spent);

}  // namespace palpate
