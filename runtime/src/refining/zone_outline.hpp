// The set that the refining lane has prepared last, by the nodes and elements of the organ.
#pragma once

#include "runtime/src/exterior/condensation.hpp"
#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

struct ZoneOutline {
  uint64_t set;  // ZoneCorrection::number; 0: none
  uint32_t num_nodes;
  uint32_t* nodes;     // [ZoneRoom::nodes]
  uint32_t* place_of;  // [num_nodes of the organ] the place of a node in `nodes`
  uint32_t num_groups;
  GroupLayout groups[kMostZoneContacts];  // their boundaries are one after the other in Condensation::kept
  size_t exterior_size;
  uint8_t* zone_of_element;  // [elements of the organ] 1 + the number of the group; 0: the exterior
  uint8_t* zone_of_lane;     // [most_lanes()] the same by lanes
  // Of the set, whose frames do not change them
  const uint32_t* unknown_of;
  const uint32_t* first_master;
};

void carve_outline(const pal_pack& pack, const ZoneRoom& room, Arena& arena, ZoneOutline& outline);

// Lists a prepared set, and the roles of the organ's nodes: boundary nodes are kept, the other nodes of the zones are absent.
// `number`: ZoneCorrection::number of the set. Returns false where the boundaries do not fit into the condensation.
bool list_outline(const pal_pack& pack, const ZoneSet& set, uint64_t number, const OrganElements& elements,
                  Condensation& own, ZoneOutline& outline);

}  // namespace palpate
