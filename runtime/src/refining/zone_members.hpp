// Lists the nodes and elements of the zones of a set, and its groups: contacts whose zones share a node.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/base/progress.hpp"
#include "runtime/src/refining/preparation.hpp"

namespace palpate {

// Clears an earlier list and begins to list the groups of the contacts that the set names.
void begin_members(const pal_pack& pack, ZonePreparation& preparation);

// Advances until `spent` reaches `operations`, multiply-adds: finds the zone of each contact, the groups, and
// the nodes, masters, elements, vectors and forces at rest of each group. Fails if the set exceeds the room,
// or if an element is inverted in the mesh.
Progress collect_members(const pal_pack& pack, uint64_t operations, ZonePreparation& preparation,
                         uint64_t& spent);

}  // namespace palpate
