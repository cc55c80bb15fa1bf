#include "runtime/src/refining/zone_outline.hpp"

#include <string.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

void carve_outline(const pal_pack& pack, const ZoneRoom& room, Arena& arena, ZoneOutline& outline) {
  outline.nodes = arena.take<uint32_t>(room.nodes);
  outline.place_of = arena.take<uint32_t>(pack.organ.num_nodes);
  outline.zone_of_element = arena.take<uint8_t>(pack.organ.num_elements);
  outline.zone_of_lane = arena.take<uint8_t>(most_lanes(pack));
}

bool list_outline(const pal_pack& pack, const ZoneSet& set, uint64_t number, const OrganElements& elements,
                  Condensation& own, ZoneOutline& outline) {
  const OrganView& organ = pack.organ;
  std::fill_n(own.roles, organ.num_nodes, NodeRole::eliminated);
  outline.set = number;
  outline.num_nodes = set.num_nodes;
  for (uint32_t i = 0; i < set.num_nodes; ++i) {
    outline.nodes[i] = organ.of_zone_node[set.nodes[i]];
    outline.place_of[outline.nodes[i]] = i;
    own.roles[outline.nodes[i]] = NodeRole::absent;
  }
  outline.num_groups = set.num_groups;
  outline.exterior_size = exterior_size(set);
  own.num_kept = 0;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneGroup& group = set.groups[g];
    outline.groups[g] = group;
    if (own.num_kept + group.num_boundary > own.room.kept) return false;
    for (uint32_t b = first_boundary(group); b < first_boundary(group) + group.num_boundary; ++b) {
      own.kept[own.num_kept++] = outline.nodes[b];
      own.roles[outline.nodes[b]] = NodeRole::kept;
    }
  }
  outline.unknown_of = set.unknown_of;
  outline.first_master = set.first_master;
  memset(outline.zone_of_element, 0, organ.num_elements * sizeof *outline.zone_of_element);
  const uint32_t* element = set.elements;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    for (const uint32_t* end = element + set.groups[g].num_elements; element < end; ++element)
      outline.zone_of_element[organ.of_zone_element[*element]] = static_cast<uint8_t>(g + 1);
  }
  list_zones(organ, elements, outline.zone_of_element, outline.zone_of_lane);
  return true;
}

}  // namespace palpate
