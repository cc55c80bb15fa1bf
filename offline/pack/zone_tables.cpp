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

// Lists the zone nodes; also fills their elements.
std::vector<pack::ZoneNode> zone_nodes(const PackContent& content, std::vector<uint32_t>& node_elements,
                                       std::vector<pack::ZoneElement>& elements) {
  const ZoneTables& zone = *content.zone;
  const Model& model = content.model;
  std::vector<uint32_t> place(static_cast<size_t>(model.num_nodes()), pack::kNoNode);
  std::vector<uint32_t> packed(place.size(), pack::kNoNode);
  for (size_t i = 0; i < zone.nodes.size(); ++i)
    place[static_cast<size_t>(zone.nodes[i])] = static_cast<uint32_t>(i);
  for (size_t i = 0; i < content.sites.packed_nodes.size(); ++i)
    packed[static_cast<size_t>(content.sites.packed_nodes[i])] = static_cast<uint32_t>(i);
  const size_t first_inner = num_panels(content.sites) * pack::kPanelNodes;
  std::vector<uint32_t> row = packed;
  for (size_t i = 0; i < zone.inner_nodes.size(); ++i)
    row[static_cast<size_t>(zone.inner_nodes[i])] = static_cast<uint32_t>(first_inner + i);
  std::vector<std::vector<uint32_t>> of_node(zone.nodes.size());
  for (const int e : zone.elements) {
    const Tetrahedron& tetrahedron = model.elements[static_cast<size_t>(e)];
    pack::ZoneElement element = {};
    element.num_nodes = static_cast<uint32_t>(tetrahedron.num_nodes);
    element.material = static_cast<uint32_t>(tetrahedron.material);
    element.volume_patch =
        tetrahedron.volume_patch < 0 ? pack::kNoPatch : static_cast<uint32_t>(tetrahedron.volume_patch);
    for (size_t a = 0; a < tetrahedron.nodes().size(); ++a) {
      element.nodes[a] = place[static_cast<size_t>(tetrahedron.nodes()[a])];
      of_node[element.nodes[a]].push_back(static_cast<uint32_t>(elements.size()));
    }
    elements.push_back(element);
  }
  const std::vector<char> fixed = model.fixed_dofs();
  const Eigen::VectorXd at_rest = content.rest != nullptr ? content.rest->displacement_of(model)
                                                          : Eigen::VectorXd::Zero(model.num_dofs());
  std::vector<pack::ZoneNode> nodes;
  for (size_t i = 0; i < zone.nodes.size(); ++i) {
    const auto at = static_cast<size_t>(zone.nodes[i]);
    pack::ZoneNode node = {};
    for (size_t axis = 0; axis < 3; ++axis) {
      node.position[axis] = model.positions[at][static_cast<Eigen::Index>(axis)];
      node.displacement[axis] = at_rest[static_cast<Eigen::Index>(3 * at + axis)];
      if (fixed[3 * at + axis] == 0) node.free_axes |= 1U << axis;
    }
    node.packed_node = packed[at];
    node.first_element = static_cast<uint32_t>(node_elements.size());
    node.num_elements = static_cast<uint32_t>(of_node[i].size());
    node.num_outside = static_cast<uint32_t>(zone.num_outside[i]);
    node.row = static_cast<int>(i) < zone.num_free ? row[at] : pack::kNoNode;
    node_elements.insert(node_elements.end(), of_node[i].begin(), of_node[i].end());
    nodes.push_back(node);
  }
  return nodes;
}

// Calls append(rows, panel) for each panel of packed nodes, then of inner nodes.
template <typename Matrix, typename Append>
void for_each_exterior_panel(const PackContent& content, const Matrix& fields, Append&& append) {
  const auto num_packed = static_cast<Eigen::Index>(content.sites.packed_nodes.size());
  const auto num_inner = static_cast<Eigen::Index>(content.zone->inner_nodes.size());
  for (const auto& rows : {fields.topRows(3 * num_packed), fields.bottomRows(3 * num_inner)}) {
    for (size_t panel = 0; panel < pack::num_panels(static_cast<uint32_t>(rows.rows() / 3)); ++panel)
      append(rows, panel);
  }
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

void add_exterior(const PackContent& content, SegmentStore& store, ZoneSegments& segments) {
  ZoneColumns exterior(content.zone->rounded);
  std::vector<double> units;
  for (const auto& fields : content.zone->exterior) {
    const Eigen::VectorXd of_columns = fields.cwiseAbs().colwise().maxCoeff().template cast<double>();
    units.insert(units.end(), of_columns.begin(), of_columns.end());
    for_each_exterior_panel(
        content, fields, [&](const auto& rows, size_t panel) { exterior.append(rows, of_columns, panel); });
  }
  segments.exterior = exterior.add_to(store);
  segments.exterior_units = store.add(units);
}

}  // namespace

ZoneSegments add_zone(const PackContent& content, SegmentStore& store) {
  const ZoneTables& zone = *content.zone;
  std::vector<uint32_t> node_elements;
  std::vector<pack::ZoneElement> elements;
  ZoneSegments segments;
  segments.nodes = store.add(zone_nodes(content, node_elements, elements));
  segments.elements = store.add(elements);
  segments.node_elements = store.add(node_elements);
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
  segments.force_scale = store.add(zone.force_scale);
  segments.more_rings = store.add(zone.more_rings);
  add_exterior(content, store, segments);
  if (!zone.pair_fields.empty()) {
    std::vector<std::int8_t> fields;
    for (const ZoneTables::PairFields& of_pair : zone.pair_fields) {
      for_each_exterior_panel(content, of_pair,
                              [&](const auto& rows, size_t panel) { append_panel(rows, panel, fields); });
    }
    segments.pair_fields = store.add(fields);
    std::vector<float> weights;
    for (const Eigen::MatrixXf& of_pair : zone.pair_weights)
      weights.insert(weights.end(), of_pair.data(), of_pair.data() + of_pair.size());
    segments.pair_weights = store.add(weights);
  }
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
  const pack::Segment force_scale = placed(zone.force_scale, base);
  const pack::Segment more_rings = placed(zone.more_rings, base);
  const pack::Segment exterior = placed(zone.exterior, base);
  const pack::Segment field_units = placed(zone.field_units, base);
  const pack::Segment exterior_units = placed(zone.exterior_units, base);
  const bool has_pairs = !content.zone->pair_fields.empty();
  const uint32_t num_pair_fields =
      has_pairs ? static_cast<uint32_t>(content.zone->pair_fields.front().cols()) : 0;
  const pack::Segment pair_fields = has_pairs ? placed(zone.pair_fields, base) : pack::Segment();
  const pack::Segment pair_weights = has_pairs ? placed(zone.pair_weights, base) : pack::Segment();
  return pack::CreateNonlinearZone(
      builder, static_cast<uint32_t>(content.zone->rings), static_cast<uint32_t>(content.zone->nodes.size()),
      static_cast<uint32_t>(content.zone->num_free), &zone_nodes_at,
      static_cast<uint32_t>(content.zone->elements.size()), &elements, &node_elements,
      static_cast<uint32_t>(content.model.materials.size()), &materials, &compliance, &field_compliance,
      static_cast<uint32_t>(content.zone->most_nodes),
      static_cast<uint32_t>(content.zone->most_boundary_nodes),
      static_cast<uint32_t>(content.zone->most_elements), &force_scale, &exterior, num_pair_fields,
      has_pairs ? &pair_fields : nullptr, has_pairs ? &pair_weights : nullptr,
      static_cast<uint32_t>(content.zone->exterior_degree), static_cast<uint32_t>(content.zone->pair_degree),
      &more_rings, static_cast<uint32_t>(content.zone->most_rim_nodes),
      static_cast<uint32_t>(content.zone->most_rim_elements),
      content.zone->rounded ? pack::FieldPrecision::i16 : pack::FieldPrecision::real, &field_units,
      &exterior_units, content.zone->between);
}

}  // namespace palpate
