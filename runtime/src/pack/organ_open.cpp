#include "runtime/src/pack/organ_open.hpp"

#include <algorithm>

#include "runtime/src/pack/number_checks.hpp"

namespace palpate {
namespace {

// Whether the element names a material of the zones and distinct nodes.
bool is_element(const pal_pack& pack, const OrganView& organ, const pack::OrganElement& element) {
  if (element.material >= pack.num_zone_materials ||
      (element.num_nodes != 4 && element.num_nodes != pack::kOrganElementNodes))
    return false;
  for (uint32_t a = 0; a < element.num_nodes; ++a) {
    if (element.nodes[a] >= organ.num_nodes) return false;
    for (uint32_t b = 0; b < a; ++b) {
      if (element.nodes[a] == element.nodes[b]) return false;
    }
  }
  return true;
}

// Whether the elements that are listed for a node are distinct and contain the node.
bool are_elements_of(const OrganView& organ, uint32_t node) {
  const uint32_t* listed = organ.node_elements + organ.nodes[node].first_element;
  for (uint32_t e = 0; e < organ.nodes[node].num_elements; ++e) {
    if (listed[e] >= organ.num_elements || (e > 0 && listed[e] <= listed[e - 1])) return false;
    const pack::OrganElement& element = organ.elements[listed[e]];
    const uint32_t* end = element.nodes + element.num_nodes;
    if (std::find(element.nodes, end, node) == end) return false;
  }
  return true;
}

bool are_nodes(const pal_pack& pack, const OrganView& organ, uint64_t num_entries) {
  uint64_t first_element = 0;
  for (uint32_t i = 0; i < organ.num_nodes; ++i) {
    const pack::OrganNode& node = organ.nodes[i];
    const bool is_packed = i < pack.num_contact_nodes
                               ? node.packed_node == pack.contact_nodes[i]
                               : node.packed_node == pack::kNoNode || node.packed_node < pack.num_nodes;
    if (!is_packed || node.free_axes > 7 || (node.free_axes == 0) != (i >= organ.num_free) ||
        node.first_element != first_element || node.num_elements > num_entries - first_element ||
        !all_within(node.position, 3, kLargestScale) || !all_within(node.displacement, 3, kLargestScale) ||
        !are_elements_of(organ, i))
      return false;
    first_element += node.num_elements;
  }
  return first_element == num_entries;
}

// Whether volume patches are numbered in order and fit the capacity. The elements of a patch must be
// consecutive, and of one material with a volumetric part.
bool are_patches(const pal_pack& pack, OrganView& organ) {
  uint32_t num_nodes = 0;
  for (uint32_t e = 0; e < organ.num_elements; ++e) {
    const pack::OrganElement& element = organ.elements[e];
    if (element.volume_patch == pack::kNoPatch) continue;
    const bool continues_patch = e > 0 && element.volume_patch == organ.elements[e - 1].volume_patch;
    if (!continues_patch && element.volume_patch != organ.num_patches++) return false;
    num_nodes = continues_patch ? num_nodes + element.num_nodes : element.num_nodes;
    if (num_nodes > pack::kMostPatchNodes ||
        pack.zone_materials[element.material].law == pack::ZoneLaw::linear_elastic ||
        (continues_patch && element.material != organ.elements[e - 1].material))
      return false;
  }
  return true;
}

// Whether the rows of a front ascend, lie behind its columns, and are columns or rows of its parent.
bool are_rows(const OrganView& organ, const pack::Front& front) {
  const uint32_t* rows = organ.rows + front.first_row;
  const pack::Front* parent = front.parent == pack::kNoFront ? nullptr : organ.fronts + front.parent;
  if ((parent == nullptr) != (front.num_rows == 0)) return false;
  uint32_t least = front.first_column + front.num_columns;
  for (uint32_t i = 0; i < front.num_rows; ++i) {
    const uint32_t place = rows[i];
    if (place < least || place >= organ.num_free) return false;
    least = place + 1;
    if (place >= parent->first_column && place - parent->first_column < parent->num_columns) continue;
    const uint32_t* parent_rows = organ.rows + parent->first_row;
    if (!std::binary_search(parent_rows, parent_rows + parent->num_rows, place)) return false;
  }
  return true;
}

bool are_fronts(const OrganView& organ, uint64_t num_rows) {
  uint64_t column = 0;
  uint64_t row = 0;
  uint64_t element = 0;
  for (uint32_t f = 0; f < organ.num_fronts; ++f) {
    const pack::Front& front = organ.fronts[f];
    if (front.first_column != column || front.num_columns < 1 ||
        front.num_columns > organ.num_free - column || front.first_row != row ||
        front.num_rows > num_rows - row || front.first_element != element ||
        front.num_elements > organ.num_elements - element || front.num_within < 1 ||
        front.num_within > f + 1 ||
        (front.parent != pack::kNoFront && (front.parent <= f || front.parent >= organ.num_fronts)))
      return false;
    // A volume patch belongs to one front.
    if (front.num_elements > 0 && element > 0 && organ.elements[element].volume_patch != pack::kNoPatch &&
        organ.elements[element].volume_patch == organ.elements[element - 1].volume_patch)
      return false;
    column += front.num_columns;
    row += front.num_rows;
    element += front.num_elements;
  }
  if (column != organ.num_free || row != num_rows || element != organ.num_elements) return false;
  // The subtrees of a front's children stand before it, one behind the other, and hold every child.
  uint32_t num_children = 0;
  uint32_t num_parents = 0;
  for (uint32_t f = 0; f < organ.num_fronts; ++f) {
    if (!are_rows(organ, organ.fronts[f])) return false;
    if (organ.fronts[f].parent != pack::kNoFront) ++num_parents;
    uint32_t num_left = organ.fronts[f].num_within - 1;
    for (uint32_t child = f; num_left > 0; ++num_children) {
      child -= child == f ? 1 : organ.fronts[child].num_within;
      if (organ.fronts[child].parent != f || organ.fronts[child].num_within > num_left) return false;
      num_left -= organ.fronts[child].num_within;
    }
  }
  if (num_children != num_parents) return false;
  // fill_front_of() checks that the places are a permutation, because this check needs memory.
  for (uint32_t place = 0; place < organ.num_free; ++place) {
    if (organ.order[place] >= organ.num_free) return false;
  }
  return true;
}

}  // namespace

bool read_organ(const pack::Organ& table, uint64_t first_offset, pal_pack& pack) {
  OrganView organ = {};
  organ.num_nodes = table.num_nodes();
  organ.num_free = table.num_free();
  organ.num_elements = table.num_elements();
  organ.num_fronts = table.num_fronts();
  if (organ.num_nodes > kMostNodes || organ.num_elements > kMostNodes || organ.num_free > organ.num_nodes ||
      organ.num_free < pack.num_contact_nodes || organ.num_fronts > organ.num_free ||
      pack.num_zone_nodes > organ.num_nodes || pack.num_zone_elements > organ.num_elements ||
      table.node_elements() == nullptr || table.rows() == nullptr)
    return false;
  const uint64_t num_entries = table.node_elements()->bytes() / sizeof(uint32_t);
  const uint64_t num_rows = table.rows()->bytes() / sizeof(uint32_t);
  organ.nodes = array_of<pack::OrganNode>(pack, table.nodes(), first_offset, organ.num_nodes);
  organ.elements = array_of<pack::OrganElement>(pack, table.elements(), first_offset, organ.num_elements);
  organ.node_elements = array_of<uint32_t>(pack, table.node_elements(), first_offset, num_entries);
  organ.fronts = array_of<pack::Front>(pack, table.fronts(), first_offset, organ.num_fronts);
  organ.order = array_of<uint32_t>(pack, table.order(), first_offset, organ.num_free);
  organ.rows = array_of<uint32_t>(pack, table.rows(), first_offset, num_rows);
  if (organ.nodes == nullptr || organ.elements == nullptr || organ.node_elements == nullptr ||
      organ.fronts == nullptr || organ.order == nullptr || organ.rows == nullptr)
    return false;
  uint64_t num_corners = 0;
  for (uint32_t e = 0; e < organ.num_elements; ++e) {
    if (!is_element(pack, organ, organ.elements[e])) return false;
    if (organ.elements[e].num_nodes != 4) ++organ.num_quadratic;
    num_corners += organ.elements[e].num_nodes;
  }
  // Lists of distinct elements that contain the node are complete if the lengths add up to the corners.
  if (num_entries != num_corners) return false;
  if (!are_nodes(pack, organ, num_entries) || !are_patches(pack, organ) || !are_fronts(organ, num_rows))
    return false;
  pack.organ = organ;
  return true;
}

}  // namespace palpate
