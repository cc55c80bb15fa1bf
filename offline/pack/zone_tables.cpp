#include <variant>

#include "offline/material/invariant_law.hpp"
#include "offline/material/ogden.hpp"
#include "offline/pack/pack_tables.hpp"

namespace palpate {
namespace {

pack::ZoneMaterial zone_material(const Law& law) {
  pack::ZoneMaterial material = {};
  const auto set = [&](pack::ZoneLaw kind, std::initializer_list<double> constants) {
    material.law = kind;
    std::copy(constants.begin(), constants.end(), material.constants);
  };
  const auto set_ogden = [&](const Ogden& law_of_stretches) {
    const auto& [mu, alpha, d] = ogden_law(law_of_stretches);
    set(pack::ZoneLaw::ogden, {mu[0], mu[1], mu[2], alpha[0], alpha[1], alpha[2], d[0], d[1], d[2]});
  };
  if (const auto* neo_hookean = std::get_if<CompressibleNeoHookean>(&law)) {
    set(pack::ZoneLaw::compressible_neo_hookean, {neo_hookean->mu, neo_hookean->lambda});
  } else if (const auto* invariant = std::get_if<InvariantLaw>(&law)) {
    if (invariant->c01 != 0) {
      set_ogden(as_ogden(*invariant));
    } else {
      const YeohLaw yeoh = yeoh_part(*invariant);
      const double* d = yeoh.inverse_d;
      set(pack::ZoneLaw::yeoh, {yeoh.c10, yeoh.c20, yeoh.c30, d[0], d[1], d[2]});
    }
  } else if (const auto* ogden = std::get_if<Ogden>(&law)) {
    set_ogden(*ogden);
  } else if (const auto* hooke = std::get_if<StVenantKirchhoff>(&law)) {
    set(pack::ZoneLaw::st_venant_kirchhoff, {hooke->mu, hooke->lambda});
  } else {
    const auto& linear = std::get<LinearElastic>(law);
    set(pack::ZoneLaw::linear_elastic, {linear.mu, linear.lambda});
  }
  return material;
}

}  // namespace

ZoneSegments add_zone(const PackContent& content, SegmentStore& store) {
  std::vector<pack::ZoneMaterial> materials;
  for (const Material& material : content.model.materials) materials.push_back(zone_material(material.law));
  return {store.add(materials)};
}

flatbuffers::Offset<pack::NonlinearZone> create_zone(const PackContent& content, const ZoneSegments& zone,
                                                     uint64_t base, flatbuffers::FlatBufferBuilder& builder) {
  const pack::Segment materials = placed(zone.materials, base);
  const ZoneTables& sizes = *content.zone;
  return pack::CreateNonlinearZone(
      builder, static_cast<uint32_t>(sizes.rings), static_cast<uint32_t>(sizes.num_nodes),
      static_cast<uint32_t>(sizes.num_elements), static_cast<uint32_t>(content.model.materials.size()),
      &materials, static_cast<uint32_t>(sizes.most_nodes), static_cast<uint32_t>(sizes.most_boundary_nodes),
      static_cast<uint32_t>(sizes.most_elements));
}

}  // namespace palpate
