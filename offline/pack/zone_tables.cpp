#include <limits>
#include <variant>
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

MeshTables zone_mesh(const PackContent& content) {
  const ZoneTables& zone = *content.zone;
  std::vector<uint32_t> volume_patches;
  for (const int e : zone.elements) {
    const int patch = content.model.elements[static_cast<size_t>(e)].volume_patch;
    volume_patches.push_back(patch < 0 ? pack::kNoPatch : static_cast<uint32_t>(patch));
  }
  MeshTables mesh = mesh_tables(content, zone.nodes, zone.elements, volume_patches);
  for (size_t i = 0; i < mesh.nodes.size(); ++i)
    mesh.nodes[i].num_outside = static_cast<uint32_t>(zone.num_outside[i]);
  return mesh;
}

// Columns of zones, divided by their units, panel after panel.
class ZoneColumns {
 public:
  explicit ZoneColumns(bool rounded) : rounded_(rounded) {}

  template <typename Columns>
  void append(const Eigen::MatrixBase<Columns>& columns, const Eigen::VectorXd& units, size_t panel) {
    if (rounded_) {
      append_rounded_panel(columns, units, panel, integers_);
    } else {
      append_panel(columns.template cast<double>() * units.cwiseMax(kLeast).cwiseInverse().asDiagonal(),
                   panel, reals_);
    }
  }

  pack::Segment add_to(SegmentStore& store) const {
    return rounded_ ? store.add(integers_) : store.add(reals_);
  }

 private:
  // guards zero columns, whose unit is 0
  static constexpr double kLeast = std::numeric_limits<double>::min();
  bool rounded_;
  std::vector<std::int16_t> integers_;
  std::vector<pack::Real> reals_;
};

void add_field_compliance(const PackContent& content, SegmentStore& store, ZoneSegments& segments) {
  const Eigen::MatrixXd& compliance = content.zone->field_compliance;
  ZoneColumns field(content.zone->rounded);
  std::vector<double> units;
  for (Eigen::Index first = 0; first < compliance.cols(); first += 3) {
    const auto columns = compliance.middleCols<3>(first);
    units.push_back(columns.cwiseAbs().maxCoeff());
    for (size_t panel = 0; panel < num_panels(content.sites); ++panel)
      field.append(columns, Eigen::VectorXd::Constant(3, units.back()), panel);
  }
  segments.field_compliance = field.add_to(store);
  segments.field_units = store.add(units);
}

}  // namespace

ZoneSegments add_zone(const PackContent& content, SegmentStore& store) {
  const ZoneTables& zone = *content.zone;
  const MeshTables mesh = zone_mesh(content);
  ZoneSegments segments;
  segments.nodes = store.add(mesh.nodes);
  segments.elements = store.add(mesh.elements);
  segments.node_elements = store.add(mesh.node_elements);
  std::vector<pack::ZoneMaterial> materials;
  for (const Material& material : content.model.materials) materials.push_back(zone_material(material.law));
  segments.materials = store.add(materials);
  const auto num_contacts = static_cast<Eigen::Index>(content.sites.contact_nodes.size());
  std::vector<double> blocks;
  for (Eigen::Index i = num_contacts; i < zone.num_free; ++i) {
    // C is symmetric: row i of C equals column i.
    const auto columns = zone.compliance.middleCols<3>(3 * (i - num_contacts));
    for (Eigen::Index j = 0; j <= i; ++j) {
      for (Eigen::Index entry = 0; entry < 9; ++entry)
        blocks.push_back(columns(3 * j + entry % 3, entry / 3));
    }
  }
  segments.compliance = store.add(blocks);
  add_field_compliance(content, store, segments);
  return segments;
}

flatbuffers::Offset<pack::NonlinearZone> create_zone(const PackContent& content, const ZoneSegments& zone,
                                                     uint64_t base, flatbuffers::FlatBufferBuilder& builder) {
  const pack::Segment zone_nodes_at = placed(zone.nodes, base);
  const pack::Segment elements = placed(zone.elements, base);
  const pack::Segment node_elements = placed(zone.node_elements, base);
  const pack::Segment materials = placed(zone.materials, base);
  const pack::Segment compliance = placed(zone.compliance, base);
  const pack::Segment field_compliance = placed(zone.field_compliance, base);
  const pack::Segment field_units = placed(zone.field_units, base);
  return pack::CreateNonlinearZone(
      builder, static_cast<uint32_t>(content.zone->rings), static_cast<uint32_t>(content.zone->nodes.size()),
      static_cast<uint32_t>(content.zone->num_free), &zone_nodes_at,
      static_cast<uint32_t>(content.zone->elements.size()), &elements, &node_elements,
      static_cast<uint32_t>(content.model.materials.size()), &materials, &compliance, &field_compliance,
      static_cast<uint32_t>(content.zone->most_nodes),
      static_cast<uint32_t>(content.zone->most_boundary_nodes),
      static_cast<uint32_t>(content.zone->most_elements),
      content.zone->rounded ? pack::FieldPrecision::i16 : pack::FieldPrecision::real, &field_units);
}

}  // namespace palpate
