// Which nodes and elements the zones of some contacts are made of, and which contacts share one.
//
// Near contacts, one of whose patches reaches into the other's zone, crush or tear most what is between them. Where a
// pack says so (pal_pack::zone_between) their group holds the elements next to a node that the zones of two contacts
// hold, each near some other, where they are in no zone themselves and of second order (zone_rim.hpp). All of them or, where
// that is more than fits, none: of any two contacts they fit. On the brain at nu = 0.45, pairs of neighbours pushed up to
// one edge, the largest error goes from 1.2 to 0.5 % of |d|, with three fifths as many nodes more.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

// Begins to list the groups of the next set, for the contacts that it names; what was begun before is forgotten.
void begin_members(const pal_pack& pack, ZoneState& state);

// Goes on with its groups, their nodes, masters, elements and rims, for about so many multiply-adds in all, from
// ZoneState::column on: the zone of each contact, who shares one, the members of each group, its rim. True when it has
// ended; the set is not sound then where that is more than the pack has declared.
bool collect_members(const pal_pack& pack, uint64_t operations, ZoneState& state, uint64_t& spent);

}  // namespace palpate
