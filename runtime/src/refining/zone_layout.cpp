#include "runtime/src/refining/zone_layout.hpp"

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

void carve_layout(const pal_pack& pack, Arena& arena, ZoneLayout& layout) {
  layout.zone_of_simd_lane = arena.take<uint8_t>(most_simd_lanes(pack));
}

void describe_zones(const pal_pack& pack, const ZonePreparation& preparation, uint64_t set_number,
                    const OrganElements& elements, Condensation& condensation, ZoneLayout& layout) {
  const ZoneSet& set = preparation.set;
  layout.set_number = set_number;
  layout.members = set;  // copies the counts and pointers of ZoneMembers, the base of ZoneSet
  layout.place_of_node = preparation.place_of;
  layout.num_groups = set.num_groups;
  layout.stiffness_size = exterior_size(set);
  std::fill_n(condensation.roles, pack.organ.num_nodes, NodeRole::eliminated);
  for (uint32_t i = 0; i < set.num_nodes; ++i) condensation.roles[set.nodes[i]] = NodeRole::absent;
  condensation.num_kept = 0;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneGroup& group = set.groups[g];
    layout.groups[g] = group;  // copies GroupLayout, the base of ZoneGroup
    const uint32_t first = first_boundary(group);
    for (uint32_t i = first; i < first + group.num_boundary; ++i) {
      condensation.kept[condensation.num_kept++] = set.nodes[i];
      condensation.roles[set.nodes[i]] = NodeRole::kept;
    }
  }
  list_zones(pack.organ, elements, preparation.group_of_element, layout.zone_of_simd_lane);
}

}  // namespace palpate
