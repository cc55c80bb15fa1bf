// Which loads x of its contacts a zone's boundary tells of (zone_exterior.hpp), and what loads move.
//
// Neighbours that pull against each other bear many times what each does alone, and all but a little of it
// never leaves the zone. What leaves are the tractions t of the group's boundary, which move the linear organ there
// by C_BB t. With V the columns by which it moves as each patch does, and K_P the stiffness of each alone,
//
//   x = Gamma t,   Gamma = K_P (V^T T V + L)^-1 V^T / force_scale,   T = C_BB^-1
//
// are the forces at the patches whose field is nearest to that one, in the linear organ's energy; L holds loads
// together that the boundary hardly tells apart.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

// ZoneGroup::loads_of_tractions and loads_of_moves of the next set, once T is known, for about so many multiply-adds in all
// from ZoneState::column, first at `begin`, on. True when it has ended. Cost: 3 boundary_stride^2 a contact, and as many blocks
// of the compliance as its patch and the boundary have nodes.
bool fit_loads(const pal_pack& pack, uint64_t operations, uint32_t begin, ZoneState& state, ZoneGroup& group,
               uint64_t& spent);

// rows[3][stride] := how the linear organ moves these nodes, [count][3], under a load of 1 along each axis on a patch. Cost: as
// many blocks of the compliance as the patch has nodes, times count.
void find_moves_of_loads(const pal_pack& pack, uint32_t site, const uint32_t* nodes, uint32_t count,
                         size_t stride, double* rows);

}  // namespace palpate
