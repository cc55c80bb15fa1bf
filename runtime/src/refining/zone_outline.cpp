#include "runtime/src/refining/zone_outline.hpp"

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

void carve_outline(const pal_pack& pack, Arena& arena, ZoneOutline& outline) {
  outline.zone_of_lane = arena.take<uint8_t>(most_lanes(pack));
}

bool list_outline(const pal_pack& pack, const ZonePreparation& preparation, uint64_t number,
                  const OrganElements& elements, Condensation& own, ZoneOutline& outline) {
  const ZoneSet& set = preparation.set;
  outline.set = number;
  outline.members = set;  // its members alone; their arrays stay those of the set
  outline.place_of = preparation.place_of;
  outline.num_groups = set.num_groups;
  outline.exterior_size = exterior_size(set);
  // All nodes of zones are absent from the condensation, but for the boundary nodes, which it keeps.
  std::fill_n(own.roles, pack.organ.num_nodes, NodeRole::eliminated);
  for (uint32_t i = 0; i < set.num_nodes; ++i) own.roles[set.nodes[i]] = NodeRole::absent;
  own.num_kept = 0;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneGroup& group = set.groups[g];
    outline.groups[g] = group;  // its layout alone
    if (own.num_kept + group.num_boundary > own.room.kept) return false;
    for (uint32_t b = first_boundary(group); b < first_boundary(group) + group.num_boundary; ++b) {
      own.kept[own.num_kept++] = set.nodes[b];
      own.roles[set.nodes[b]] = NodeRole::kept;
    }
  }
  list_zones(pack.organ, elements, preparation.zone_of_element, outline.zone_of_lane);
  return true;
}

}  // namespace palpate
