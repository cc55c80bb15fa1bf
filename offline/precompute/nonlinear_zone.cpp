#include "offline/precompute/nonlinear_zone.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "offline/precompute/linear_dd.hpp"

namespace palpate {
ZoneFinder::ZoneFinder(const Model& model)
    : model_(&model), by_node_(static_cast<size_t>(model.num_nodes())) {
  for (size_t e = 0; e < model.elements.size(); ++e) {
    for (const int node : model.elements[e].nodes())
      by_node_[static_cast<size_t>(node)].push_back(static_cast<int>(e));
    const int patch = model.elements[e].volume_patch;
    if (patch < 0) continue;
    by_patch_.resize(std::max(by_patch_.size(), static_cast<size_t>(patch) + 1));
    by_patch_[static_cast<size_t>(patch)].push_back(static_cast<int>(e));
  }
}

std::vector<int> ZoneFinder::elements_about(const ContactSite& site, int rings) const {
  std::set<int> elements;
  std::set<int> nodes(site.patch_nodes.begin(), site.patch_nodes.end());
  std::vector<int> outermost = site.patch_nodes;
  for (int ring = 0; ring < rings; ++ring) {
    std::vector<int> found;
    for (const int at : outermost) {
      for (const int e : elements_of(at)) {
        if (!elements.insert(e).second) continue;
        for (const int node : model_->elements[static_cast<size_t>(e)].nodes()) {
          if (nodes.insert(node).second) found.push_back(node);
        }
      }
    }
    outermost = std::move(found);
  }
  std::set<int> patches;
  for (const int e : elements) {
    const int patch = model_->elements[static_cast<size_t>(e)].volume_patch;
    if (patch >= 0) patches.insert(patch);
  }
  for (const int patch : patches) {
    const std::vector<int>& of_patch = by_patch_[static_cast<size_t>(patch)];
    elements.insert(of_patch.begin(), of_patch.end());
  }
  return {elements.begin(), elements.end()};
}

ZoneTables find_zones(const Scene& scene, const Model& model, const ContactSites& sites, int rings) {
  const ZoneFinder finder(model);
  const auto num_nodes = static_cast<size_t>(model.num_nodes());
  std::vector<char> element_carried(model.elements.size());
  ZoneTables zone;
  zone.rings = rings;
  zone.rounded = rounds_fields(scene);
  for (const ContactSite& site : sites.sites) {
    const std::vector<int> elements = finder.elements_about(site, rings);
    std::map<int, size_t> inside;  // elements of the zone at each of its nodes
    for (const int e : elements) {
      element_carried[static_cast<size_t>(e)] = 1;
      for (const int node : model.elements[static_cast<size_t>(e)].nodes()) ++inside[node];
    }
    const auto num_boundary = std::ranges::count_if(
        inside, [&](const auto& node) { return node.second < finder.elements_of(node.first).size(); });
    zone.most_nodes = std::max(zone.most_nodes, static_cast<int>(inside.size()));
    zone.most_boundary_nodes = std::max(zone.most_boundary_nodes, static_cast<int>(num_boundary));
    zone.most_elements = std::max(zone.most_elements, static_cast<int>(elements.size()));
  }
  std::vector<int> carried(num_nodes, 0);  // carried elements at each node
  for (size_t e = 0; e < element_carried.size(); ++e) {
    if (element_carried[e] == 0) continue;
    zone.elements.push_back(static_cast<int>(e));
    for (const int node : model.elements[e].nodes()) ++carried[static_cast<size_t>(node)];
  }
  const auto patch_of = [&](int e) {
    const int patch = model.elements[static_cast<size_t>(e)].volume_patch;
    return patch < 0 ? pack::kNoPatch : static_cast<std::uint32_t>(patch);
  };
  std::ranges::stable_sort(zone.elements, {}, patch_of);
  const std::vector<char> fixed = model.fixed_dofs();
  const auto is_fixed = [&](size_t node) {
    return fixed[3 * node] != 0 && fixed[3 * node + 1] != 0 && fixed[3 * node + 2] != 0;
  };
  std::vector<char> is_contact(num_nodes);
  for (size_t c = 0; c < sites.contact_nodes.size(); ++c) {
    zone.nodes.push_back(sites.model_node(static_cast<int>(c)));
    is_contact[static_cast<size_t>(zone.nodes.back())] = 1;
  }
  for (const bool fixed_ones : {false, true}) {
    for (size_t node = 0; node < num_nodes; ++node) {
      if (carried[node] > 0 && is_contact[node] == 0 && is_fixed(node) == fixed_ones)
        zone.nodes.push_back(static_cast<int>(node));
    }
    if (!fixed_ones) zone.num_free = static_cast<int>(zone.nodes.size());
  }
  for (const int node : zone.nodes) {
    zone.num_outside.push_back(static_cast<int>(finder.elements_of(node).size()) -
                               carried[static_cast<size_t>(node)]);
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
  // K is symmetric; an asymmetry is rounding.
  auto own = zone.compliance.bottomRows(num_columns);
  own = 0.5 * (own + own.transpose()).eval();
}

double zone_bytes(const ZoneTables& zone, const ContactSites& sites) {
  const auto contacts = static_cast<double>(sites.contact_nodes.size());
  const double free = zone.num_free;
  const double panels = pack::num_panels(static_cast<std::uint32_t>(sites.packed_nodes.size()));
  const double of_nodes =
      (free - contacts) *
      (panels * static_cast<double>(pack::field_panel_bytes(3, zone.rounded)) + sizeof(double));
  return 9 * sizeof(double) * 0.5 * (free * (free + 1) - contacts * (contacts + 1)) + of_nodes;
}

}  // namespace palpate
