#include "runtime/src/pack/zone_open.hpp"

#include "runtime/kernels/isotropic_law.hpp"
#include "runtime/src/pack/number_checks.hpp"

namespace palpate {
namespace {

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
  if (pack.zone_rings < 1 || pack.zone_rings > pack::kMostZoneRings ||
      pack.num_zone_nodes < pack.num_contact_nodes || pack.most_zone_nodes > pack.num_zone_nodes ||
      pack.most_zone_boundary > pack.most_zone_nodes || pack.most_zone_elements > pack.num_zone_elements)
    return false;
  pack.zone_materials =
      array_of<pack::ZoneMaterial>(pack, zone.materials(), first_offset, pack.num_zone_materials);
  if (pack.zone_materials == nullptr) return false;
  for (uint32_t i = 0; i < pack.num_zone_materials; ++i) {
    if (!is_material(pack.zone_materials[i])) return false;
  }
  return true;
}

}  // namespace palpate
