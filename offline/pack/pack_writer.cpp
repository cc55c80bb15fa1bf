#include "offline/pack/pack_writer.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <stdexcept>
#include <type_traits>
#include <variant>

#include "offline/pack/frame_cost.hpp"
#include "offline/precompute/surface_bvh.hpp"
#include "schemas/monomials.hpp"
#include "schemas/pack_checksum.hpp"
#include "schemas/pack_generated.h"
#include "schemas/pack_layout.hpp"

namespace palpate {
namespace {

// Bulk arrays, one after the other, each at a multiple of pack::kAlignment.
class SegmentStore {
 public:
  // Returns position and size of the array; offsets count from the first segment.
  template <typename Values>
  pack::Segment add(const Values& values) {
    const size_t offset = body_.size();
    const size_t bytes = values.size() * sizeof(typename Values::value_type);
    body_.resize(pack::round_up(offset + bytes, pack::kAlignment), 0);
    if (bytes > 0) std::memcpy(body_.data() + offset, values.data(), bytes);
    return {offset, bytes};
  }
  // Converts to the pack's precision.
  pack::Segment add_reals(const std::vector<float>& values) {
    if constexpr (std::is_same_v<pack::Real, float>) {
      return add(values);
    } else {
      return add(std::vector<pack::Real>(values.begin(), values.end()));
    }
  }
  const std::vector<unsigned char>& body() const { return body_; }

 private:
  std::vector<unsigned char> body_;
};

struct GeometrySegments {
  pack::Segment labels, positions, triangles;
};
struct SiteSegments {
  pack::Segment contact_nodes, site_nodes, patch_starts, patch_nodes, inward_normals;
};
struct LinearSegments {
  pack::Segment contact_compliance, field_compliance, site_forces;
};
struct CompressedSegments {
  pack::Segment panels, node_places, basis, blocks, coefficients;
};
struct PolynomialSegments {
  pack::Segment sites, energy, coefficients, field;
};
struct GravitySegments {
  pack::Segment acceleration, rest_positions, field_per_gravity, contact_per_gravity;
};
struct SurfaceSegments {
  pack::Segment primitives, nodes, primitive_normals, site_normals;
};

struct ZoneSegments {
  pack::Segment nodes, elements, node_elements, materials, compliance, field_compliance, field_units,
      force_scale, more_rings, exterior, exterior_units, pair_fields, pair_weights;
};

std::vector<uint32_t> as_unsigned(const std::vector<int>& values) {
  return {values.begin(), values.end()};
}

size_t num_panels(const ContactSites& sites) {
  return pack::num_panels(static_cast<uint32_t>(sites.packed_nodes.size()));
}

// Appends the rows of one panel, column by column; pads with zeros.
template <typename Columns, typename Number>
void append_panel(const Eigen::MatrixBase<Columns>& columns, size_t panel, std::vector<Number>& out) {
  for (Eigen::Index column = 0; column < columns.cols(); ++column) {
    for (size_t i = 0; i < pack::kPanelRows; ++i) {
      const auto row = static_cast<Eigen::Index>(panel * pack::kPanelRows + i);
      out.push_back(row < columns.rows() ? static_cast<Number>(columns(row, column)) : Number{0});
    }
  }
}

// Appends a panel as int16 in units of `units` (pack::rounded_place). Needs at least three columns.
template <typename Columns>
void append_rounded_panel(const Eigen::MatrixBase<Columns>& columns, const Eigen::VectorXd& units,
                          size_t panel, std::vector<std::int16_t>& out) {
  const auto count = static_cast<uint32_t>(columns.cols());
  const size_t start = out.size();
  out.resize(start + pack::rounded_panel_numbers(count));
  const auto first = static_cast<Eigen::Index>(panel * pack::kPanelRows);
  const Eigen::Index rows = std::min<Eigen::Index>(pack::kPanelRows, columns.rows() - first);
  for (uint32_t column = 0; column < count; ++column) {
    const double per_unit = units[column] > 0 ? pack::kBasisUnit / units[column] : 0;
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double entry = per_unit * static_cast<double>(columns(first + i, column));
      out[start + pack::rounded_place(column, static_cast<uint32_t>(i))] =
          static_cast<std::int16_t>(std::lround(entry));
    }
  }
}

GeometrySegments add_geometry(const Model& model, const ContactSites& sites, SegmentStore& store) {
  std::vector<int32_t> labels;
  std::vector<double> positions;
  for (const int node : sites.packed_nodes) {
    labels.push_back(model.labels[static_cast<size_t>(node)]);
    const Eigen::Vector3d& x = model.positions[static_cast<size_t>(node)];
    positions.insert(positions.end(), {x[0], x[1], x[2]});
  }
  std::vector<uint32_t> triangles;
  for (const std::array<int, 3>& triangle : sites.triangles) {
    for (const int corner : triangle) triangles.push_back(static_cast<uint32_t>(corner));
  }
  return {store.add(labels), store.add(positions), store.add(triangles)};
}

SiteSegments add_sites(const ContactSites& sites, Directions directions, SegmentStore& store) {
  std::vector<uint32_t> site_nodes;
  std::vector<uint32_t> starts = {0};
  std::vector<uint32_t> members;
  std::vector<double> normals;
  for (const ContactSite& site : sites.sites) {
    site_nodes.push_back(static_cast<uint32_t>(site.packed_node));
    for (const int member : site.patch) members.push_back(static_cast<uint32_t>(member));
    starts.push_back(static_cast<uint32_t>(members.size()));
    if (directions == Directions::inward)
      normals.insert(normals.end(), site.inward.begin(), site.inward.end());
  }
  return {store.add(as_unsigned(sites.contact_nodes)), store.add(site_nodes), store.add(starts),
          store.add(members), store.add(normals)};
}

// Lists the lower triangle as 3 x 3 blocks, row by row.
std::vector<double> lower_blocks(const Eigen::MatrixXd& symmetric) {
  std::vector<double> blocks;
  const Eigen::Index num_nodes = symmetric.rows() / 3;
  blocks.reserve(9 * pack::lower_block(static_cast<uint64_t>(num_nodes), 0));
  for (Eigen::Index i = 0; i < num_nodes; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      for (Eigen::Index entry = 0; entry < 9; ++entry)
        blocks.push_back(symmetric(3 * i + entry / 3, 3 * j + entry % 3));
    }
  }
  return blocks;
}

// Lists three columns for each node, panel by panel.
std::vector<pack::Real> field_columns(const Eigen::MatrixXd& columns, size_t panels) {
  std::vector<pack::Real> field;
  field.reserve(panels * pack::kPanelRows * static_cast<size_t>(columns.cols()));
  for (Eigen::Index node = 0; node < columns.cols() / 3; ++node) {
    for (size_t panel = 0; panel < panels; ++panel)
      append_panel(columns.middleCols<3>(3 * node), panel, field);
  }
  return field;
}

LinearSegments add_linear(const LinearDd& linear, const ContactSites& sites, SegmentStore& store) {
  return {store.add(lower_blocks(linear.contact_compliance)),
          store.add(field_columns(linear.field_compliance, num_panels(sites))),
          {}};
}

std::vector<double> by_rows(const Eigen::MatrixXd& matrix) {
  std::vector<double> numbers;
  for (const auto& row : matrix.rowwise()) numbers.insert(numbers.end(), row.begin(), row.end());
  return numbers;
}

// Returns the forces of each site's patch; `compliance_of(site)` is the compliance of the patch.
template <typename ComplianceOf>
std::vector<double> forces_of_sites(const ContactSites& sites, ComplianceOf&& compliance_of) {
  std::vector<double> forces;
  for (const ContactSite& site : sites.sites) {
    const std::vector<double> rows = by_rows(patch_forces(compliance_of(site)));
    forces.insert(forces.end(), rows.begin(), rows.end());
  }
  return forces;
}

std::vector<double> site_forces(const PackContent& content) {
  if (content.compressed != nullptr) {
    return forces_of_sites(content.sites, [&](const ContactSite& site) {
      return patch_compliance(*content.compressed, content.sites, site);
    });
  }
  return forces_of_sites(content.sites, [&](const ContactSite& site) -> Eigen::MatrixXd {
    const std::vector<Eigen::Index> dofs = patch_dofs(site);
    return content.linear->contact_compliance(dofs, dofs);
  });
}

CompressedSegments add_compressed(const CompressedCompliance& compressed, SegmentStore& store) {
  return {store.add(compressed.panels), store.add(compressed.node_places), store.add_reals(compressed.basis),
          store.add(compressed.blocks), store.add_reals(compressed.coefficients)};
}

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

void append_bytes(const void* data, size_t count, std::vector<unsigned char>& bytes) {
  const auto* from = static_cast<const unsigned char*>(data);
  bytes.insert(bytes.end(), from, from + count);
}

// Coefficients of divided monomials x^a/a! y^b/b! z^c/c!.
void append_energy(const SitePolynomial& polynomial, std::vector<double>& energy) {
  const auto factorial = [](uint32_t n) {
    double product = 1;
    for (uint32_t i = 2; i <= n; ++i) product *= i;
    return product;
  };
  const Eigen::Index skipped = pack::monomial_start(2);
  pack::for_each_monomial(static_cast<uint32_t>(polynomial.degree) + 1, [&](Eigen::Index index, uint32_t a,
                                                                            uint32_t b, uint32_t c) {
    if (index < skipped) return;
    energy.push_back(factorial(a) * factorial(b) * factorial(c) * polynomial.energy[index - skipped]);
  });
}

PolynomialSegments add_polynomials(const std::vector<SiteResult>& results, const ContactSites& contact_sites,
                                   bool rounded, SegmentStore& store) {
  std::vector<pack::PolynomialSite> sites;
  std::vector<double> energy;
  std::vector<pack::Real> coefficients;
  std::vector<unsigned char> field;
  const size_t panels = num_panels(contact_sites);
  for (const SiteResult& result : results) {
    const SitePolynomial& polynomial = result.polynomial;
    pack::PolynomialSite site = {};
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(site.to_unit) = polynomial.to_unit;
    site.min_jacobian = result.min_jacobian;
    site.basis_error = polynomial.basis_error;
    site.energy_start = energy.size();
    site.coefficients_start = coefficients.size();
    site.field_start = field.size();
    site.degree = static_cast<std::uint32_t>(polynomial.degree);
    site.rank = static_cast<std::uint32_t>(polynomial.basis.cols());
    site.samples = static_cast<std::uint32_t>(result.samples);
    if (rounded) site.linear_unit = linear_unit(polynomial.linear);
    sites.push_back(site);
    append_energy(polynomial, energy);
    const std::vector<double> rows = by_rows(polynomial.coefficients);
    for (const double number : rows) coefficients.push_back(static_cast<pack::Real>(number));
    Eigen::MatrixXd columns(polynomial.linear.rows(), 3 + polynomial.basis.cols());
    columns << polynomial.linear, polynomial.basis;
    Eigen::VectorXd units = Eigen::VectorXd::Ones(columns.cols());
    units.head<3>().setConstant(static_cast<double>(site.linear_unit));
    std::vector<std::int16_t> integers;
    std::vector<pack::Real> reals;
    for (size_t panel = 0; panel < panels; ++panel) {
      if (rounded)
        append_rounded_panel(columns, units, panel, integers);
      else
        append_panel(columns, panel, reals);
    }
    append_bytes(integers.data(), integers.size() * sizeof integers[0], field);
    append_bytes(reals.data(), reals.size() * sizeof reals[0], field);
  }
  return {store.add(sites), store.add(energy), store.add(coefficients), store.add(field)};
}

GravitySegments add_gravity(const PackContent& content, SegmentStore& store) {
  const RestState& rest = *content.rest;
  GravitySegments segments;
  segments.acceleration = store.add(by_rows(*content.scene.gravity));
  std::vector<double> positions = by_rows(packed_rows(content.sites, rest.displacement));
  for (size_t i = 0; i < positions.size(); ++i) {
    const auto node = static_cast<size_t>(content.sites.packed_nodes[i / 3]);
    positions[i] += content.model.positions[node][static_cast<Eigen::Index>(i % 3)];
  }
  segments.rest_positions = store.add(positions);
  if (rest.per_gravity.size() == 0) return segments;
  const Eigen::MatrixXd per_gravity = packed_rows(content.sites, rest.per_gravity);
  std::vector<pack::Real> field;
  for (size_t panel = 0; panel < num_panels(content.sites); ++panel) append_panel(per_gravity, panel, field);
  segments.field_per_gravity = store.add(field);
  std::vector<double> contact;
  for (const int node : content.sites.contact_nodes) {
    const std::vector<double> rows = by_rows(per_gravity.middleRows<3>(3 * node));
    contact.insert(contact.end(), rows.begin(), rows.end());
  }
  segments.contact_per_gravity = store.add(contact);
  return segments;
}

// Returns the model with its nodes at rest, where tools find the surface.
Model at_rest(const PackContent& content) {
  Model model = content.model;
  if (content.rest != nullptr && !content.rest->is_mesh()) {
    for (int node = 0; node < model.num_nodes(); ++node)
      model.positions[static_cast<size_t>(node)] += content.rest->displacement.segment<3>(3 * node);
  }
  return model;
}

flatbuffers::Offset<pack::ErrorBin> table_of(const SurveyBin& bin, flatbuffers::FlatBufferBuilder& builder) {
  return pack::CreateErrorBin(builder, bin.from, bin.to, static_cast<uint32_t>(bin.samples),
                              bin.displacement.median, bin.displacement.p95, bin.displacement.max,
                              bin.force.median, bin.force.p95, bin.force.max, bin.displacement.bound,
                              bin.force.bound, bin.displacement.growth, bin.force.growth);
}

pack::SetErrors packed(const SetKindErrors& errors) {
  return {static_cast<uint32_t>(num_contacts_of(errors.kind)),
          is_near(errors.kind) ? 1u : 0u,
          static_cast<uint32_t>(errors.sets),
          static_cast<uint32_t>(errors.unsolved),
          static_cast<uint32_t>(errors.flagged),
          0,
          errors.displacement.median,
          errors.displacement.p95,
          errors.displacement.max,
          errors.force.median,
          errors.force.p95,
          errors.force.max};
}

pack::ResponseModel schema_model(SurveyedModel model) {
  switch (model) {
    case SurveyedModel::linear_dd:
      return pack::ResponseModel::linear_dd;
    case SurveyedModel::polynomial_dd:
      return pack::ResponseModel::polynomial_dd;
    case SurveyedModel::nonlinear_zone:
      return pack::ResponseModel::nonlinear_zone;
    case SurveyedModel::affine_site:
      return pack::ResponseModel::affine_site;
  }
  throw std::logic_error("no such model");
}

}  // namespace

AlignedBytes::AlignedBytes(size_t size)
    : data_(static_cast<unsigned char*>(::operator new(size, std::align_val_t(pack::kAlignment)))),
      size_(size) {
  std::memset(data_.get(), 0, size);
}

void AlignedBytes::Release::operator()(unsigned char* data) const {
  ::operator delete(data, std::align_val_t(pack::kAlignment));
}

AlignedBytes write_pack(const PackContent& content) {
  SegmentStore store;
  const GeometrySegments geometry = add_geometry(content.model, content.sites, store);
  const SiteSegments sites = add_sites(content.sites, content.scene.directions, store);
  LinearSegments linear;
  CompressedSegments compressed;
  PolynomialSegments polynomial;
  if (content.linear != nullptr) linear = add_linear(*content.linear, content.sites, store);
  if (content.compressed != nullptr) compressed = add_compressed(*content.compressed, store);
  if (content.has_linear()) linear.site_forces = store.add(site_forces(content));
  if (content.polynomials != nullptr)
    polynomial = add_polynomials(*content.polynomials, content.sites, content.rounded, store);
  ZoneSegments zone;
  if (content.zone != nullptr) zone = add_zone(content, store);
  const bool has_gravity = content.rest != nullptr && !content.rest->is_mesh();
  GravitySegments gravity;
  if (has_gravity) gravity = add_gravity(content, store);
  const SurfaceBvh bvh = build_surface_bvh(at_rest(content), extract_surface(content.model), content.sites);
  const SurfaceSegments surface = {store.add(bvh.primitives), store.add(bvh.nodes),
                                   store.add(bvh.primitive_normals), store.add(bvh.site_normals)};
  std::vector<pack::Segment> input_contents;
  for (const InputFile& input : content.inputs) {
    if (content.scene.embed_inputs) input_contents.push_back(store.add(input.contents));
  }

  // The tables' size does not depend on their offsets. The first pass measures the size, the second writes
  // true offsets.
  const auto write_tables = [&](uint64_t base, flatbuffers::FlatBufferBuilder& builder) {
    const auto at = [base](const pack::Segment& segment) {
      return pack::Segment(base + segment.offset(), segment.bytes());
    };
    std::vector<flatbuffers::Offset<pack::InputFile>> inputs;
    for (size_t i = 0; i < content.inputs.size(); ++i) {
      const InputFile& input = content.inputs[i];
      const std::string name = std::filesystem::path(input.path).filename().string();
      pack::Segment contents;
      if (content.scene.embed_inputs) contents = at(input_contents[i]);
      inputs.push_back(pack::CreateInputFileDirect(builder, name.c_str(), input.hash.c_str(),
                                                   input.path.c_str(),
                                                   content.scene.embed_inputs ? &contents : nullptr));
    }
    flatbuffers::Offset<pack::Units> units;
    if (!content.scene.length_unit.empty()) {
      units = pack::CreateUnitsDirect(builder, content.scene.length_unit.c_str(),
                                      content.scene.force_unit.c_str(), content.scene.metres_per_length_unit,
                                      content.scene.newtons_per_force_unit);
    }
    const pack::Segment labels = at(geometry.labels);
    const pack::Segment positions = at(geometry.positions);
    const pack::Segment triangles = at(geometry.triangles);
    const auto geometry_table = pack::CreateGeometry(
        builder, static_cast<uint32_t>(content.sites.packed_nodes.size()), &labels, &positions,
        static_cast<uint32_t>(content.sites.triangles.size()), &triangles, content.sites.mean_surface_edge,
        static_cast<uint32_t>(content.model.num_nodes()),
        static_cast<uint32_t>(content.model.elements.size()));
    const pack::Segment contact_nodes = at(sites.contact_nodes);
    const pack::Segment site_nodes = at(sites.site_nodes);
    const pack::Segment patch_starts = at(sites.patch_starts);
    const pack::Segment patch_nodes = at(sites.patch_nodes);
    const pack::Segment inward_normals = at(sites.inward_normals);
    const auto sites_table = pack::CreateContactSites(
        builder, static_cast<uint32_t>(content.sites.contact_nodes.size()), &contact_nodes,
        static_cast<uint32_t>(content.sites.sites.size()), &site_nodes, &patch_starts, &patch_nodes,
        content.scene.tip_radius, content.scene.max_displacement,
        static_cast<uint32_t>(content.scene.max_contacts),
        content.scene.directions == Directions::inward ? &inward_normals : nullptr);
    flatbuffers::Offset<pack::LinearDd> linear_table;
    const pack::Segment forces_of_sites = at(linear.site_forces);
    if (content.linear != nullptr) {
      const pack::Segment contact_compliance = at(linear.contact_compliance);
      const pack::Segment field_compliance = at(linear.field_compliance);
      linear_table =
          pack::CreateLinearDd(builder, &contact_compliance, &field_compliance, 0, &forces_of_sites);
    } else if (content.compressed != nullptr) {
      const pack::Segment panels = at(compressed.panels);
      const pack::Segment node_places = at(compressed.node_places);
      const pack::Segment basis = at(compressed.basis);
      const pack::Segment blocks = at(compressed.blocks);
      const pack::Segment coefficients = at(compressed.coefficients);
      const auto compressed_table = pack::CreateCompressedCompliance(
          builder, static_cast<uint32_t>(content.compressed->panels.size()), &panels, &node_places, &basis,
          &blocks, &coefficients, content.compressed->tolerance, content.compressed->displacement_error,
          content.compressed->force_error, static_cast<uint32_t>(content.compressed->samples));
      linear_table = pack::CreateLinearDd(builder, nullptr, nullptr, compressed_table, &forces_of_sites);
    }
    flatbuffers::Offset<pack::PolynomialDd> polynomial_table;
    if (content.polynomials != nullptr) {
      const pack::Segment sites_at = at(polynomial.sites);
      const pack::Segment energy = at(polynomial.energy);
      const pack::Segment coefficients = at(polynomial.coefficients);
      const pack::Segment field = at(polynomial.field);
      polynomial_table =
          pack::CreatePolynomialDd(builder, static_cast<uint32_t>(highest_degree(*content.polynomials)),
                                   content.rounded ? pack::FieldPrecision::i16 : pack::FieldPrecision::real,
                                   &sites_at, &energy, &coefficients, &field);
    }
    flatbuffers::Offset<pack::NonlinearZone> zone_table;
    if (content.zone != nullptr) {
      const pack::Segment zone_nodes_at = at(zone.nodes);
      const pack::Segment elements = at(zone.elements);
      const pack::Segment node_elements = at(zone.node_elements);
      const pack::Segment materials = at(zone.materials);
      const pack::Segment compliance = at(zone.compliance);
      const pack::Segment field_compliance = at(zone.field_compliance);
      const pack::Segment force_scale = at(zone.force_scale);
      const pack::Segment more_rings = at(zone.more_rings);
      const pack::Segment exterior = at(zone.exterior);
      const pack::Segment field_units = at(zone.field_units);
      const pack::Segment exterior_units = at(zone.exterior_units);
      const bool has_pairs = !content.zone->pair_fields.empty();
      const uint32_t num_pair_fields =
          has_pairs ? static_cast<uint32_t>(content.zone->pair_fields.front().cols()) : 0;
      const pack::Segment pair_fields = has_pairs ? at(zone.pair_fields) : pack::Segment();
      const pack::Segment pair_weights = has_pairs ? at(zone.pair_weights) : pack::Segment();
      zone_table = pack::CreateNonlinearZone(
          builder, static_cast<uint32_t>(content.zone->rings),
          static_cast<uint32_t>(content.zone->nodes.size()), static_cast<uint32_t>(content.zone->num_free),
          &zone_nodes_at, static_cast<uint32_t>(content.zone->elements.size()), &elements, &node_elements,
          static_cast<uint32_t>(content.model.materials.size()), &materials, &compliance, &field_compliance,
          static_cast<uint32_t>(content.zone->most_nodes),
          static_cast<uint32_t>(content.zone->most_boundary_nodes),
          static_cast<uint32_t>(content.zone->most_elements), &force_scale, &exterior, num_pair_fields,
          has_pairs ? &pair_fields : nullptr, has_pairs ? &pair_weights : nullptr,
          static_cast<uint32_t>(content.zone->exterior_degree),
          static_cast<uint32_t>(content.zone->pair_degree), &more_rings,
          static_cast<uint32_t>(content.zone->most_rim_nodes),
          static_cast<uint32_t>(content.zone->most_rim_elements),
          content.zone->rounded ? pack::FieldPrecision::i16 : pack::FieldPrecision::real, &field_units,
          &exterior_units, content.zone->between);
    }
    const pack::Segment primitives = at(surface.primitives);
    const pack::Segment nodes = at(surface.nodes);
    const pack::Segment primitive_normals = at(surface.primitive_normals);
    const pack::Segment site_normals = at(surface.site_normals);
    const auto surface_table = pack::CreateSurfaceBvh(builder, static_cast<uint32_t>(bvh.primitives.size()),
                                                      &primitives, static_cast<uint32_t>(bvh.nodes.size()),
                                                      &nodes, &primitive_normals, &site_normals);
    flatbuffers::Offset<pack::Gravity> gravity_table;
    if (has_gravity) {
      const pack::Segment acceleration = at(gravity.acceleration);
      const pack::Segment rest_positions = at(gravity.rest_positions);
      const pack::Segment field_per_gravity = at(gravity.field_per_gravity);
      const pack::Segment contact_per_gravity = at(gravity.contact_per_gravity);
      const bool may_turn = content.scene.gravity_may_turn;
      gravity_table = pack::CreateGravity(builder, &acceleration, &rest_positions,
                                          may_turn ? &field_per_gravity : nullptr,
                                          may_turn ? &contact_per_gravity : nullptr);
    }
    std::vector<flatbuffers::Offset<pack::ErrorSurvey>> surveys;
    for (const ModelSurvey& survey : content.surveys) {
      std::vector<flatbuffers::Offset<pack::ErrorBin>> bins;
      for (const SurveyBin& bin : survey.table.bins) bins.push_back(table_of(bin, builder));
      const auto overall = table_of(survey.table.overall, builder);
      std::vector<pack::SetErrors> sets;
      uint32_t most_contacts = 0;
      for (const SetKindErrors& kind : survey.sets.kinds) {
        sets.push_back(packed(kind));
        most_contacts = std::max(most_contacts, sets.back().contacts());
      }
      // Without unflagged responses the pack has no data for an estimate.
      if (!(survey.sets.over_load.displacement > 0)) most_contacts = 0;
      surveys.push_back(pack::CreateErrorSurveyDirect(
          builder, schema_model(survey.model), &bins, overall, sets.empty() ? nullptr : &sets, most_contacts,
          survey.sets.over_load.displacement, survey.sets.over_load.force, survey.table.force_scale,
          survey.sets.over_reach.displacement, survey.sets.over_reach.force));
    }
    std::vector<flatbuffers::Offset<pack::FrameCost>> costs;
    for (const FrameCost& cost : count_frame_costs(content)) {
      costs.push_back(pack::CreateFrameCost(builder, schema_model(cost.model), cost.force_operations,
                                            cost.force_bytes, cost.field_operations, cost.field_bytes));
    }
    pack::FinishPackBuffer(
        builder, pack::CreatePackDirect(builder, PALPATE_VERSION, &inputs, units, geometry_table, sites_table,
                                        linear_table, polynomial_table, &surveys, &costs, surface_table,
                                        gravity_table, sizeof(pack::Real), zone_table));
  };
  flatbuffers::FlatBufferBuilder sizing;
  write_tables(0, sizing);
  const uint64_t base = pack::round_up(sizeof(pack::PackHeader) + sizing.GetSize(), pack::kAlignment);
  flatbuffers::FlatBufferBuilder tables;
  write_tables(base, tables);

  AlignedBytes file(base + store.body().size());
  unsigned char* bytes = file.bytes().data();
  pack::PackHeader header = {};
  std::memcpy(header.magic, pack::kMagic, sizeof header.magic);
  header.format_version = pack::kFormatVersion;
  header.header_bytes = sizeof header;
  header.tables_offset = sizeof header;
  header.tables_bytes = tables.GetSize();
  header.file_bytes = file.bytes().size();
  std::memcpy(bytes, &header, sizeof header);
  std::memcpy(bytes + sizeof header, tables.GetBufferPointer(), tables.GetSize());
  std::memcpy(bytes + base, store.body().data(), store.body().size());
  header.checksum = pack::checksum_of(bytes, file.bytes().size());
  std::memcpy(bytes, &header, sizeof header);
  return file;
}

int highest_degree(const std::vector<SiteResult>& results) {
  int highest = 0;
  for (const SiteResult& result : results) highest = std::max(highest, result.polynomial.degree);
  return highest;
}

double estimate_pack_bytes(const ContactSites& sites, bool linear, PolynomialSize polynomials, bool rounded,
                           bool compressed) {
  const size_t packed_nodes = sites.packed_nodes.size();
  const size_t contact_nodes = sites.contact_nodes.size();
  const auto num_sites = static_cast<double>(sites.sites.size());
  const double rows =
      pack::num_panels(static_cast<uint32_t>(packed_nodes)) * static_cast<double>(pack::kPanelRows);
  // A closed surface has two triangles for each node, and its tree one node for each triangle.
  constexpr double kSurfaceBytesOfASite =
      2.0 * (sizeof(SurfaceBvh::primitives[0]) + sizeof(SurfaceBvh::primitive_normals[0]) +
             sizeof(pack::BvhNode)) +
      sizeof(PackedNormal);
  double bytes = 40.0 * static_cast<double>(packed_nodes) + 4096.0 + kSurfaceBytesOfASite * num_sites;
  if (linear) {
    bytes += compressed ? estimate_compressed_bytes(packed_nodes, contact_nodes)
                        : dense_compliance_bytes(packed_nodes, contact_nodes);
    for (const ContactSite& site : sites.sites)
      bytes += 9.0 * sizeof(double) * static_cast<double>(site.patch.size());
  }
  if (const auto [degree, rank] = polynomials; degree > 0) {
    const double panels = rows / pack::kPanelRows;
    const size_t tables = sizeof(pack::PolynomialSite) + sizeof(double) * pack::num_monomials(2, degree + 1) +
                          sizeof(pack::Real) * pack::num_monomials(2, degree) * rank;
    bytes += num_sites * (panels * static_cast<double>(pack::field_panel_bytes(3 + rank, rounded)) +
                          static_cast<double>(tables));
  }
  return bytes;
}

}  // namespace palpate
