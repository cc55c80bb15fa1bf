// From one set of contacts to the next: a set that is made ready goes on where the one that answers has got to.
//
// Nodes that both have keep their places; where others are, the linear organ says under the tractions of the set before.
// A patch is where its nodes are in the mean, and turned as it was, also where its contact has slid from the site next
// to it.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

// Places the next set by what the one that answers has got to, for its first tangents, node after node from
// ZoneState::column on, for about so many multiply-adds in all. True when it has ended.
bool place_next(const pal_pack& pack, uint64_t operations, ZoneState& state, uint64_t& spent);

// The next set goes on from where that is by now, and answers; the one that did is next.
void let_next_answer(const pal_pack& pack, ZoneState& state);

}  // namespace palpate
