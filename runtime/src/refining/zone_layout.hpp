// Describes which nodes and elements of the organ belong to the zones of the set that the refining lane
// iterates.
//
// Frames solve the set at the same time, so the refining lane reads this description instead of the set.
#pragma once

#include "runtime/src/exterior/condensation.hpp"
#include "runtime/src/refining/preparation.hpp"

namespace palpate {

struct ZoneLayout {
  uint64_t set_number;  // ZoneCorrection::number; 0: none
  // The refining lane reads `num_nodes`, `nodes`, `unknown_of` and `first_master` alone. Frames do not change
  // them.
  ZoneMembers members;
  const uint32_t*
      place_of_node;  // [num_nodes of the organ] place of each node in `members`; undefined outside the zones
  uint32_t num_groups;
  GroupLayout groups[kMostZoneContacts];
  size_t stiffness_size;  // floats of S of all groups, the exterior's stiffness on their boundaries
  // [most_simd_lanes()] the element of each SIMD lane: 1 + the group whose zone holds it; 0: the exterior
  uint8_t* zone_of_simd_lane;
};

void carve_layout(const pal_pack& pack, Arena& arena, ZoneLayout& layout);

// Fills `layout` for the prepared set, lists the boundary nodes in Condensation::kept, and gives every node
// its role:
//   - kept: the boundary nodes of the groups, one group after the other;
//   - absent: the other nodes of the zones;
//   - eliminated: the rest of the organ.
//
// `set_number`: ZoneCorrection::number of the set, whose boundary nodes are at most ZoneRoom::boundary.
void describe_zones(const pal_pack& pack, const ZonePreparation& preparation, uint64_t set_number,
                    const OrganElements& elements, Condensation& condensation, ZoneLayout& layout);

}  // namespace palpate
