#include "runtime/src/pack/zone_open.hpp"

#include <math.h>

#include "runtime/kernels/isotropic_law.hpp"
#include "runtime/src/pack/mesh_checks.hpp"
#include "runtime/src/pack/number_checks.hpp"

namespace palpate {
namespace {

bool is_node(const pal_pack& pack, const pack::ZoneNode& node, uint32_t index, uint64_t num_entries) {
  const bool is_contact = index < pack.num_contact_nodes;
  return (is_contact ? node.packed_node == pack.contact_nodes[index]
                     : node.packed_node == pack::kNoNode || node.packed_node < pack.num_nodes) &&
         node.free_axes <= 7 && (!is_contact || node.free_axes != 0) && node.num_elements <= num_entries &&
         node.first_element <= num_entries - node.num_elements &&
         all_within(node.position, 3, kLargestScale) && all_within(node.displacement, 3, kLargestScale);
}

// Whether elements of a volume patch are consecutive, within the capacity, and of one law with a volumetric
// part.
bool are_patches(const pal_pack& pack) {
  uint32_t num_nodes = 0;
  for (uint32_t i = 0; i < pack.num_zone_elements; ++i) {
    const pack::ZoneElement& element = pack.zone_elements[i];
    const bool goes_on = i > 0 && element.volume_patch == pack.zone_elements[i - 1].volume_patch;
    num_nodes = goes_on ? num_nodes + element.num_nodes : element.num_nodes;
    if (i > 0 && element.volume_patch < pack.zone_elements[i - 1].volume_patch) return false;
    if (element.volume_patch == pack::kNoPatch) continue;
    if (num_nodes > pack::kMostPatchNodes ||
        pack.zone_materials[element.material].law == pack::ZoneLaw::linear_elastic ||
        (goes_on && element.material != pack.zone_elements[i - 1].material))
      return false;
  }
  return true;
}

bool is_material(const pack::ZoneMaterial& material) {
  if (static_cast<uint32_t>(material.law) >= pack::kZoneLaws ||
      !all_within(material.constants, pack::kZoneConstants, kLargestScale))
    return false;
  const double* mu = material.constants;
  const double* alpha = mu + kOgdenTerms;
  bool sound = true;
  for (int i = 0; i < kOgdenTerms && material.law == pack::ZoneLaw::ogden; ++i)
    sound = sound && (mu[i] == 0 || alpha[i] != 0);
  return sound;
}

}  // namespace

bool read_zone(const pack::NonlinearZone& zone, uint64_t first_offset, pal_pack& pack) {
  if (pack.field_compliance == nullptr) return false;
  pack.zone_rings = zone.rings();
  pack.num_zone_nodes = zone.num_nodes();
  pack.num_zone_elements = zone.num_elements();
  pack.most_zone_nodes = zone.most_nodes();
  pack.most_zone_boundary = zone.most_boundary_nodes();
  pack.most_zone_elements = zone.most_elements();
  pack.num_zone_materials = zone.num_materials();
  if (pack.zone_rings < 1 || pack.zone_rings > pack::kMostZoneRings || pack.num_zone_nodes > kMostNodes ||
      pack.num_zone_elements > kMostNodes || pack.num_zone_nodes < pack.num_contact_nodes ||
      pack.most_zone_nodes > pack.num_zone_nodes || pack.most_zone_boundary > pack.most_zone_nodes ||
      pack.most_zone_elements > pack.num_zone_elements)
    return false;
  const auto* nodes = array_of<pack::ZoneNode>(pack, zone.nodes(), first_offset, pack.num_zone_nodes);
  pack.zone_elements =
      array_of<pack::ZoneElement>(pack, zone.elements(), first_offset, pack.num_zone_elements);
  if (nodes == nullptr || pack.zone_elements == nullptr || zone.node_elements() == nullptr) return false;
  const uint64_t num_entries = zone.node_elements()->bytes() / sizeof(uint32_t);
  pack.zone_node_elements = array_of<uint32_t>(pack, zone.node_elements(), first_offset, num_entries);
  pack.zone_materials =
      array_of<pack::ZoneMaterial>(pack, zone.materials(), first_offset, pack.num_zone_materials);
  if (pack.zone_node_elements == nullptr || pack.zone_materials == nullptr) return false;
  uint64_t first_element = 0;
  for (uint32_t i = 0; i < pack.num_zone_nodes; ++i) {
    if (nodes[i].first_element != first_element || !is_node(pack, nodes[i], i, num_entries)) return false;
    first_element += nodes[i].num_elements;
  }
  if (first_element != num_entries) return false;
  for (uint32_t i = 0; i < pack.num_zone_elements; ++i) {
    if (!is_mesh_element(pack, pack.num_zone_nodes, pack.zone_elements[i])) return false;
    if (pack.zone_elements[i].num_nodes != 4) ++pack.num_quadratic;
    if (pack.zone_elements[i].volume_patch != pack::kNoPatch) ++pack.num_sharing;
  }
  if (!are_patches(pack)) return false;
  for (uint32_t i = 0; i < pack.num_zone_nodes; ++i) {
    if (!are_elements_of(pack.zone_node_elements + nodes[i].first_element, nodes[i].num_elements,
                         pack.zone_elements, pack.num_zone_elements, i))
      return false;
  }
  for (uint32_t i = 0; i < pack.num_zone_materials; ++i) {
    if (!is_material(pack.zone_materials[i])) return false;
  }
  pack.zone_nodes = nodes;
  return true;
}

}  // namespace palpate
