// The set that the refining lane has prepared last, as the lane iterates its exterior while frames solve its zones.
#pragma once

#include "runtime/src/exterior/condensation.hpp"
#include "runtime/src/refining/preparation.hpp"

namespace palpate {

struct ZoneOutline {
  uint64_t set;  // ZoneCorrection::number; 0: none
  // Of the set. The lane reads `nodes`, `unknown_of` and `first_master`, which frames do not change
  ZoneMembers members;
  const uint32_t* place_of;  // ZonePreparation::place_of
  uint32_t num_groups;
  GroupLayout groups[kMostZoneContacts];  // their boundaries are one after the other in Condensation::kept
  size_t exterior_size;
  uint8_t* zone_of_lane;  // [most_lanes()] 1 + the number of the element's group; 0: the exterior
};

void carve_outline(const pal_pack& pack, Arena& arena, ZoneOutline& outline);

// Lists a prepared set, and the roles of the organ's nodes: boundary nodes are kept, the other nodes of the zones are absent.
// `number`: ZoneCorrection::number of the set. Returns false where the boundaries do not fit into the condensation.
bool list_outline(const pal_pack& pack, const ZonePreparation& preparation, uint64_t number,
                  const OrganElements& elements, Condensation& own, ZoneOutline& outline);

}  // namespace palpate
