// How a set of contacts is made ready (zone_set.hpp): step after step, few of which take longer than 40 us where patches hold
// ten nodes (pal_session_config::budget_seconds).
//
//   collect      which nodes and elements its groups hold, and room for them (zone_members.hpp)
//   and of each group
//   compliance   [ C_BB . ; 1 0 ], of whose elimination T is left
//   inverse
//   whole        T
//   stiffness    K_V at rest
//   own          its elimination
//   condensed    S = T - S_int
//   couple       C between this boundary and the others
//   then
//   place        where the set before has got to (zone_handover.hpp)
//   tangent      of each group (zone_tangent.hpp)
//   done         it answers
//
// Work is counted in multiply-adds as fast as elimination makes them, so that the same frames do the same on any processor.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

// Begins to make the next set, for 1 .. max_contacts contacts and at most max_fixed fixed nodes.
void begin_zone(const pal_pack& pack, const pal_contact* contacts, uint32_t count, const FixedNodes& fixed,
                ZoneState& state);

// Goes on with it for about so many multiply-adds, 1 or more. Once it is ready it answers, from where the one before has got to,
// and true is returned. Cost in all, for each group, n = 3 x boundary nodes and m = 3 x all nodes: 7/6 n^3 + m^3 / 6.
bool advance_zone(const pal_pack& pack, uint64_t operations, ZoneState& state);

}  // namespace palpate
