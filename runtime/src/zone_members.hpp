// Which nodes and elements the zones of some contacts are made of, and which contacts share one.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/zone_set.hpp"

namespace palpate {

// Lists the groups of the next set, their nodes, masters, elements and rims, for the contacts that it names. False where
// that is more than the pack has declared.
bool find_zone_members(const pal_pack& pack, ZoneState& state);

}  // namespace palpate
