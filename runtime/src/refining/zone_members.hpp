// Which nodes and elements the zones of some contacts are made of, and which contacts share one.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/refining/preparation.hpp"

namespace palpate {

// Begins to list the groups of the set, for the contacts that it names. Forgets an earlier list.
void begin_members(const pal_pack& pack, ZonePreparation& preparation);

// Goes on with its groups, their nodes, masters and elements, for about so many multiply-adds in all, from
// ZonePreparation::column on: the zone of each contact, who shares one, the members of each group. True when it has ended; the
// set is not sound then where that is more than the pack has declared.
bool collect_members(const pal_pack& pack, uint64_t operations, ZonePreparation& preparation,
                     uint64_t& spent);

}  // namespace palpate
