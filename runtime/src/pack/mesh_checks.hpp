// Checks of a mesh in a pack, of a zone's or the organ's.
#pragma once

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

// Whether the element names a material of the zone and distinct nodes.
inline bool is_mesh_element(const pal_pack& pack, uint32_t num_nodes, const pack::ZoneElement& element) {
  if (element.material >= pack.num_zone_materials ||
      (element.num_nodes != 4 && element.num_nodes != pack::kZoneElementNodes))
    return false;
  for (uint32_t a = 0; a < element.num_nodes; ++a) {
    if (element.nodes[a] >= num_nodes) return false;
    for (uint32_t b = 0; b < a; ++b) {
      if (element.nodes[a] == element.nodes[b]) return false;
    }
  }
  return true;
}

// Whether `listed`, the elements of a node, are distinct and contain the node. The work of a frame is then bounded by
// the file.
inline bool are_elements_of(const uint32_t* listed, uint32_t count, const pack::ZoneElement* elements,
                            uint32_t num_elements, uint32_t node) {
  for (uint32_t e = 0; e < count; ++e) {
    if (listed[e] >= num_elements || (e > 0 && listed[e] <= listed[e - 1])) return false;
    const pack::ZoneElement& element = elements[listed[e]];
    bool has = false;
    for (uint32_t a = 0; a < element.num_nodes; ++a) has = has || element.nodes[a] == node;
    if (!has) return false;
  }
  return true;
}

}  // namespace palpate
