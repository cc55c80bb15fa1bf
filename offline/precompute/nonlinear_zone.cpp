#include "offline/precompute/nonlinear_zone.hpp"

#include <algorithm>
#include <stdexcept>
#include <variant>

#include "offline/precompute/linear_dd.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {
namespace {

// The elements at each node.
std::vector<std::vector<int>> elements_by_node(const Model& model) {
  std::vector<std::vector<int>> elements(static_cast<size_t>(model.num_nodes()));
  for (size_t e = 0; e < model.elements.size(); ++e) {
    for (const int node : model.elements[e].nodes())
      elements[static_cast<size_t>(node)].push_back(static_cast<int>(e));
  }
  return elements;
}

// The elements of a site's zone.
std::vector<int> zone_of(const Model& model, const std::vector<std::vector<int>>& by_node,
                         const ContactSite& site, int rings, std::vector<char>& node_seen,
                         std::vector<char>& element_seen) {
  std::vector<int> elements;
  std::vector<int> nodes = site.patch_nodes;
  for (const int node : nodes) node_seen[static_cast<size_t>(node)] = 1;
  size_t ring_begin = 0;
  for (int ring = 0; ring < rings; ++ring) {
    const size_t ring_end = nodes.size();
    for (size_t i = ring_begin; i < ring_end; ++i) {
      for (const int e : by_node[static_cast<size_t>(nodes[i])]) {
        if (element_seen[static_cast<size_t>(e)] != 0) continue;
        element_seen[static_cast<size_t>(e)] = 1;
        elements.push_back(e);
        for (const int node : model.elements[static_cast<size_t>(e)].nodes()) {
          if (node_seen[static_cast<size_t>(node)] != 0) continue;
          node_seen[static_cast<size_t>(node)] = 1;
          nodes.push_back(node);
        }
      }
    }
    ring_begin = ring_end;
  }
  for (const int node : nodes) node_seen[static_cast<size_t>(node)] = 0;
  for (const int e : elements) element_seen[static_cast<size_t>(e)] = 0;
  return elements;
}

}  // namespace

std::string why_no_zone(const Model& model) {
  for (const Material& material : model.materials) {
    if (!has_dyadic_tangent(material.law)) {
      return "material " + material.name +
             " is of a law that nonlinear zones do not know: they take COMPRESSIBLE NEO HOOKE, NEO HOOKE and "
             "YEOH";
    }
  }
  return "";
}

ZoneTables find_zones(const Model& model, const ContactSites& sites, int rings) {
  const std::vector<std::vector<int>> by_node = elements_by_node(model);
  std::vector<char> node_seen(by_node.size());
  std::vector<char> element_seen(model.elements.size());
  std::vector<char> element_carried(model.elements.size());
  ZoneTables zone;
  zone.rings = rings;
  for (const ContactSite& site : sites.sites) {
    const std::vector<int> elements = zone_of(model, by_node, site, rings, node_seen, element_seen);
    std::vector<int> inside(by_node.size(), 0);
    int num_nodes = 0;
    for (const int e : elements) {
      element_carried[static_cast<size_t>(e)] = 1;
      for (const int node : model.elements[static_cast<size_t>(e)].nodes())
        num_nodes += inside[static_cast<size_t>(node)]++ == 0 ? 1 : 0;
    }
    int num_boundary = 0;
    for (size_t node = 0; node < by_node.size(); ++node)
      num_boundary += inside[node] > 0 && inside[node] < static_cast<int>(by_node[node].size()) ? 1 : 0;
    zone.most_nodes = std::max(zone.most_nodes, num_nodes);
    zone.most_boundary_nodes = std::max(zone.most_boundary_nodes, num_boundary);
    zone.most_elements = std::max(zone.most_elements, static_cast<int>(elements.size()));
  }
  std::vector<int> carried(by_node.size(), 0);  // elements carried at each node
  for (size_t e = 0; e < element_carried.size(); ++e) {
    if (element_carried[e] == 0) continue;
    zone.elements.push_back(static_cast<int>(e));
    for (const int node : model.elements[e].nodes()) ++carried[static_cast<size_t>(node)];
  }
  const std::vector<char> fixed = model.fixed_dofs();
  const auto is_fixed = [&](size_t node) {
    return fixed[3 * node] != 0 && fixed[3 * node + 1] != 0 && fixed[3 * node + 2] != 0;
  };
  std::vector<char> is_contact(by_node.size());
  for (size_t c = 0; c < sites.contact_nodes.size(); ++c) {
    zone.nodes.push_back(sites.model_node(static_cast<int>(c)));
    is_contact[static_cast<size_t>(zone.nodes.back())] = 1;
  }
  for (const bool fixed_ones : {false, true}) {
    for (size_t node = 0; node < by_node.size(); ++node) {
      if (carried[node] > 0 && is_contact[node] == 0 && is_fixed(node) == fixed_ones)
        zone.nodes.push_back(static_cast<int>(node));
    }
    if (!fixed_ones) zone.num_free = static_cast<int>(zone.nodes.size());
  }
  for (const int node : zone.nodes) {
    const auto at = static_cast<size_t>(node);
    zone.num_outside.push_back(static_cast<int>(by_node[at].size()) - carried[at]);
  }
  return zone;
}

void compute_zone_compliance(const Assembly& assembly, const ContactSites& sites, const RestState& rest,
                             const std::function<void(int, int)>& progress, ZoneTables& zone) {
  constexpr Eigen::Index kBlock = 48;  // right-hand sides that share one pass over the factor
  StaticSolver solver(assembly);
  factor_at_rest(solver, rest);
  const auto num_contacts = static_cast<Eigen::Index>(sites.contact_nodes.size());
  const Eigen::Index num_columns = 3 * (zone.num_free - num_contacts);
  zone.compliance.resize(3 * zone.num_free, num_columns);
  zone.field_compliance.resize(3 * static_cast<Eigen::Index>(sites.packed_nodes.size()), num_columns);
  const std::vector<char> fixed = assembly.model().fixed_dofs();
  for (Eigen::Index first = 0; first < num_columns; first += kBlock) {
    const Eigen::Index width = std::min(kBlock, num_columns - first);
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(assembly.num_dofs(), width);
    for (Eigen::Index j = 0; j < width; ++j) {
      const Eigen::Index column = first + j;
      const Eigen::Index dof = 3 * zone.nodes[static_cast<size_t>(num_contacts + column / 3)] + column % 3;
      if (fixed[static_cast<size_t>(dof)] == 0) columns(dof, j) = 1.0;
    }
    if (!solver.back_solve(columns)) throw std::logic_error("a Cholesky factor always solves");
    zone.field_compliance.middleCols(first, width) = packed_rows(sites, columns);
    for (Eigen::Index node = 0; node < zone.num_free; ++node) {
      zone.compliance.block(3 * node, first, 3, width) =
          columns.middleRows<3>(3 * zone.nodes[static_cast<size_t>(node)]);
    }
    if (progress) progress(static_cast<int>(first + width), static_cast<int>(num_columns));
  }
  // K is symmetric, so what is left of asymmetry is rounding.
  auto own = zone.compliance.bottomRows(num_columns);
  own = 0.5 * (own + own.transpose()).eval();
}

double zone_bytes(const ZoneTables& zone, const ContactSites& sites) {
  const auto contacts = static_cast<double>(sites.contact_nodes.size());
  const double free = zone.num_free;
  const double panels = pack::num_panels(static_cast<std::uint32_t>(sites.packed_nodes.size()));
  return 9 * sizeof(double) * 0.5 * (free * (free + 1) - contacts * (contacts + 1)) +
         (free - contacts) * panels * 3 * pack::kPanelRows * sizeof(pack::Real);
}

}  // namespace palpate
