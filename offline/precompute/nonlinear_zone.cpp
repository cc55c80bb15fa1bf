#include "offline/precompute/nonlinear_zone.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "offline/precompute/linear_dd.hpp"

namespace palpate {
namespace {

// Factor by which the remainder of an order grows with the ratio of bulk to shear modulus, relative to nu =
// 0.4. Follows the root of the ratio (bench/zones/ZONES.md).
double growth_with_bulk(const Model& model) {
  double ratio = 0;
  for (const Tetrahedron& element : model.elements) {
    const Law& law = model.materials[static_cast<size_t>(element.material)].law;
    const SmallStrainModuli moduli = small_strain_moduli(law);
    if (!std::holds_alternative<LinearElastic>(law)) ratio = std::max(ratio, moduli.bulk / moduli.shear);
  }
  return std::sqrt(ratio / (14.0 / 3));
}

// Chooses the degree of the exterior in the loads for this reach. The remainder at one edge grows like the
// first omitted order. A quarter of the target suffices; the zone itself needs the rest.
int exterior_degree(double reach_in_edges, double growth, double accuracy_target) {
  constexpr double kLeft[] = {1.1e-3, 2.7e-4};
  int degree = pack::kLeastZoneDegree;
  for (const double left : kLeft) {
    if (growth * left * std::pow(reach_in_edges, degree) <= accuracy_target / 4) break;
    ++degree;
  }
  return degree;
}

// Chooses the degree of pair interaction in the same way.
int pair_degree(double reach_in_edges, double growth, double accuracy_target) {
  constexpr double kLeft = 3e-3;
  return growth * kLeft * reach_in_edges * reach_in_edges <= accuracy_target / 2 ? pack::kLeastPairDegree
                                                                                 : pack::kMostPairDegree;
}

// Chooses the number of a pair's own second-order columns. Outside of one ring the zone's error hides the difference.
int num_pair_fields(int rings, int pair_degree, double reach_in_edges, double growth,
                    double accuracy_target) {
  const double left = growth * (rings > 1 ? 0.01 : 0.002) * reach_in_edges;
  return (accuracy_target < left ? 16 : 8) + (pair_degree > 2 ? kThirdOrderFields : 0);
}

// Whether zones of near contacts include the elements between them, by the error without these elements.
bool holds_between(double reach_in_edges, double growth, double accuracy_target) {
  constexpr double kLeft = 4.3e-3;
  return growth * kLeft * reach_in_edges * reach_in_edges > accuracy_target;
}

// As the runtime's near-field rings.
bool has_second_order(const Model& model, int e) {
  const Tetrahedron& element = model.elements[static_cast<size_t>(e)];
  return element.volume_patch < 0 &&
         !std::holds_alternative<LinearElastic>(model.materials[static_cast<size_t>(element.material)].law);
}

bool reaches_into(const ContactSite& site, const std::vector<int>& nodes_of_zone) {
  return std::ranges::any_of(site.patch_nodes,
                             [&](int node) { return std::ranges::binary_search(nodes_of_zone, node); });
}

// Rounded up.
int part_of(size_t count, int contacts) {
  const auto of = static_cast<size_t>(contacts);
  return static_cast<int>((count + of - 1) / of);
}

}  // namespace

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

std::vector<int> ZoneFinder::nodes_of(const std::vector<int>& elements) const {
  std::set<int> nodes;
  for (const int e : elements) {
    const auto of_element = model_->elements[static_cast<size_t>(e)].nodes();
    nodes.insert(of_element.begin(), of_element.end());
  }
  return {nodes.begin(), nodes.end()};
}

std::vector<int> ZoneFinder::elements_next_to(const std::vector<int>& elements) const {
  std::set<int> next;
  for (const int node : nodes_of(elements)) next.insert(elements_of(node).begin(), elements_of(node).end());
  for (const int e : elements) next.erase(e);
  return {next.begin(), next.end()};
}

std::vector<int> ZoneFinder::elements_of_near(const std::vector<int>& elements,
                                              const std::vector<int>& others) const {
  std::set<int> together(elements.begin(), elements.end());
  together.insert(others.begin(), others.end());
  const std::vector<int> nodes = nodes_of(elements);
  const std::vector<int> nodes_of_others = nodes_of(others);
  std::vector<int> shared;
  std::ranges::set_intersection(nodes, nodes_of_others, std::back_inserter(shared));
  for (const int node : shared) {
    for (const int e : elements_of(node)) {
      if (has_second_order(*model_, e)) together.insert(e);
    }
  }
  return {together.begin(), together.end()};
}

std::vector<int> ZoneFinder::rim_of(const std::vector<int>& elements) const {
  std::vector<int> rim = elements_next_to(elements);
  std::erase_if(rim, [&](int e) { return !has_second_order(*model_, e); });
  return rim;
}

ZoneTables find_zones(const Scene& scene, const Model& model, const ContactSites& sites, int rings,
                      std::vector<std::uint8_t> more_rings, bool may_hold_between) {
  const ZoneFinder finder(model);
  const auto num_nodes = static_cast<size_t>(model.num_nodes());
  std::vector<char> element_carried(model.elements.size());
  std::vector<char> in_zone(num_nodes);
  ZoneTables zone;
  zone.rings = rings;
  zone.rounded = rounds_fields(scene);
  zone.more_rings = std::move(more_rings);
  zone.more_rings.resize(sites.sites.size());
  const double reach_in_edges = scene.max_displacement / sites.mean_surface_edge;
  const double growth = growth_with_bulk(model);
  zone.exterior_degree = exterior_degree(reach_in_edges, growth, scene.accuracy_target);
  // A small Poisson ratio must not reduce the degree of the pairs.
  const double growth_of_pairs = std::max(1.0, growth);
  zone.pair_degree = pair_degree(reach_in_edges, growth_of_pairs, scene.accuracy_target);
  const std::size_t num_sites = sites.sites.size();
  const bool has_rims = scene.max_contacts > 1 && num_sites > 1 && num_sites <= pack::kMostMutualSites;
  if (has_rims) {
    zone.num_pairs = num_sites * (num_sites - 1) / 2;
    zone.num_pair_fields =
        num_pair_fields(rings, zone.pair_degree, reach_in_edges, growth_of_pairs, scene.accuracy_target);
    zone.between = may_hold_between && holds_between(reach_in_edges, growth, scene.accuracy_target);
  }
  // Counts a zone that `contacts` contacts share.
  const auto count_zone = [&](const std::vector<int>& elements, int contacts) {
    std::map<int, size_t> inside;  // elements of the zone at each of its nodes
    for (const int e : elements) {
      element_carried[static_cast<size_t>(e)] = 1;
      for (const int node : model.elements[static_cast<size_t>(e)].nodes()) {
        ++inside[node];
        in_zone[static_cast<size_t>(node)] = 1;
      }
    }
    const auto num_boundary = std::ranges::count_if(
        inside, [&](const auto& node) { return node.second < finder.elements_of(node.first).size(); });
    zone.most_nodes = std::max(zone.most_nodes, part_of(inside.size(), contacts));
    zone.most_boundary_nodes =
        std::max(zone.most_boundary_nodes, part_of(static_cast<size_t>(num_boundary), contacts));
    zone.most_elements = std::max(zone.most_elements, part_of(elements.size(), contacts));
  };
  // Near pairs get the near-field ring of single contacts; the whole ring enlarges packs without gain.
  const auto count_rim = [&](const std::vector<int>& elements, int contacts) {
    const std::vector<int> rim = finder.rim_of(elements);
    for (const int e : rim) {
      if (contacts == 1) element_carried[static_cast<size_t>(e)] = 1;
    }
    zone.most_rim_nodes = std::max(zone.most_rim_nodes, part_of(finder.nodes_of(rim).size(), contacts));
    zone.most_rim_elements = std::max(zone.most_rim_elements, part_of(rim.size(), contacts));
  };
  for (int fewer = rings; fewer >= (has_rims ? 1 : rings); --fewer) {
    std::vector<std::vector<int>> zones;
    std::vector<std::vector<int>> nodes;
    for (size_t s = 0; s < num_sites; ++s) {
      zones.push_back(finder.elements_about(sites.sites[s], zone.rings_of(s, fewer)));
      nodes.push_back(finder.nodes_of(zones[s]));
      if (fewer == rings) count_zone(zones[s], 1);
      if (has_rims) count_rim(zones[s], 1);
    }
    for (size_t s = 0; s < num_sites && zone.between; ++s) {
      for (size_t other = 0; other < s; ++other) {
        if (!reaches_into(sites.sites[s], nodes[other]) && !reaches_into(sites.sites[other], nodes[s]))
          continue;
        const std::vector<int> elements = finder.elements_of_near(zones[s], zones[other]);
        count_zone(elements, 2);
        count_rim(elements, 2);
      }
    }
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
  std::vector<char> is_packed(num_nodes);
  for (const int node : sites.packed_nodes) is_packed[static_cast<size_t>(node)] = 1;
  for (int i = 0; i < zone.num_free; ++i) {
    const int node = zone.nodes[static_cast<size_t>(i)];
    if (is_packed[static_cast<size_t>(node)] == 0 &&
        (zone.between || in_zone[static_cast<size_t>(node)] != 0))
      zone.inner_nodes.push_back(node);
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

std::vector<Eigen::Index> exterior_dofs(const ContactSites& sites, const ZoneTables& zone) {
  std::vector<Eigen::Index> dofs;
  for (const std::vector<int>* nodes : {&sites.packed_nodes, &zone.inner_nodes}) {
    for (const int node : *nodes) {
      for (int axis = 0; axis < 3; ++axis) dofs.push_back(3 * node + axis);
    }
  }
  return dofs;
}

double zone_bytes(const ZoneTables& zone, const ContactSites& sites) {
  const auto pairs = static_cast<double>(zone.num_pairs);
  const auto contacts = static_cast<double>(sites.contact_nodes.size());
  const double free = zone.num_free;
  const double panels = pack::num_panels(static_cast<std::uint32_t>(sites.packed_nodes.size()));
  const double all_panels = panels + pack::num_panels(static_cast<std::uint32_t>(zone.inner_nodes.size()));
  const std::uint32_t columns = pack::num_monomials(2, static_cast<std::uint32_t>(zone.exterior_degree));
  const double of_sites = zone.rings * static_cast<double>(sites.sites.size()) *
                          (all_panels * static_cast<double>(pack::field_panel_bytes(columns, zone.rounded)) +
                           columns * sizeof(double));
  const double of_nodes =
      (free - contacts) *
      (panels * static_cast<double>(pack::field_panel_bytes(3, zone.rounded)) + sizeof(double));
  const int of_pair = zone.num_pair_fields;
  return 9 * sizeof(double) * 0.5 * (free * (free + 1) - contacts * (contacts + 1)) + of_sites + of_nodes +
         pairs * of_pair * all_panels * pack::kPanelRows +
         zone.rings * pairs * pack::num_pair_monomials(static_cast<std::uint32_t>(zone.pair_degree)) *
             (2 * pack::kPairColumns + static_cast<std::uint32_t>(of_pair)) * sizeof(float);
}

}  // namespace palpate
