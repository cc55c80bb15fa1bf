#include "offline/pack/frame_cost.hpp"

#include <algorithm>

#include "schemas/monomials.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {
namespace {

// Counts a compressed compliance, the worst case over the sites. A pair of patch nodes takes 9 multiply-adds
// for each column of its block, and reads three rows of the basis and the coefficients. A field reads all
// blocks of the patch nodes, and the columns of the basis that these blocks use.
void count_compressed(const CompressedCompliance& compressed, const ContactSites& sites, FrameCost& cost) {
  const size_t num_panels = compressed.panels.size();
  std::uint64_t pair_operations = 0;
  std::uint64_t pair_bytes = 0;
  cost.field_operations = 0;
  cost.field_bytes = 0;
  for (const ContactSite& site : sites.sites) {
    std::uint64_t operations = 0;
    std::uint64_t bytes = 0;
    std::vector<std::uint32_t> columns(num_panels, 0);
    std::uint64_t values = 0;
    for (const int j : site.patch) {
      const pack::CompressedBlock* blocks = &compressed.blocks[static_cast<size_t>(j) * num_panels];
      for (const int i : site.patch) {
        if (i < j) continue;
        const auto node = static_cast<size_t>(sites.contact_nodes[static_cast<size_t>(i)]);
        const std::uint32_t rank = blocks[compressed.node_places[node] / pack::kPanelNodes].rank;
        operations += rank == pack::kPanelRows ? 0 : std::uint64_t{9} * rank;
        bytes += sizeof(pack::Real) * (rank == pack::kPanelRows ? 9 : std::uint64_t{6} * rank);
      }
      for (size_t panel = 0; panel < num_panels; ++panel) {
        values += std::uint64_t{3} * blocks[panel].rank;
        if (blocks[panel].rank < pack::kPanelRows)
          columns[panel] = std::max(columns[panel], blocks[panel].rank);
      }
    }
    for (const std::uint32_t count : columns) values += std::uint64_t{count} * pack::kPanelRows;
    pair_operations = std::max(pair_operations, operations);
    pair_bytes = std::max(pair_bytes, bytes);
    cost.field_operations = std::max(cost.field_operations, values);
    cost.field_bytes = std::max(cost.field_bytes, values * sizeof(pack::Real));
  }
  cost.force_operations += pair_operations;
  cost.force_bytes = pair_bytes;
}

FrameCost linear_cost(const PackContent& content, std::uint64_t rows) {
  // A new contact inserts its m nodes successively (runtime/src/linear), n = 3 m:
  //   6 (3 i)^2 for insertion number i,   9 n^2 for refinement,   3 n m for unit forces,
  //   36 m for the stiffness,   3 n for the nodal forces,   n for the force.
  // Bytes: a 3 x 3 block for each pair of nodes, and a second read of the row of a node.
  std::uint64_t m = 0;
  for (const ContactSite& site : content.sites.sites) m = std::max<std::uint64_t>(m, site.patch.size());
  const std::uint64_t n = 3 * m;
  FrameCost cost;
  cost.model = SurveyedModel::linear_dd;
  cost.force_operations = 54 * ((m - 1) * m * (2 * m - 1) / 6) + 9 * n * n + 3 * n * m + 36 * m + 4 * n;
  cost.force_bytes = (m * (m + 1) / 2 + m) * 9 * sizeof(double);
  cost.field_operations = rows * n;
  cost.field_bytes = rows * n * sizeof(pack::Real);
  if (content.compressed != nullptr) count_compressed(*content.compressed, content.sites, cost);
  return cost;
}

FrameCost zone_cost(const PackContent& content, std::uint64_t rows) {
  // Counts the default limit of Newton iterations in a frame, with m unknowns. Each iteration has
  // substitutions, a product with the exterior stiffness, and element forces.
  const auto m = static_cast<std::uint64_t>(3 * content.zone->most_nodes);
  const auto boundary = static_cast<std::uint64_t>(3 * content.zone->most_boundary_nodes);
  const auto elements = static_cast<std::uint64_t>(content.zone->most_elements);
  std::uint64_t dofs = 0;  // of the largest element of the organ
  for (const Tetrahedron& element : content.model.elements)
    dofs = std::max<std::uint64_t>(dofs, 3 * element.nodes().size());
  constexpr std::uint64_t kIterations = 4;
  FrameCost cost;
  cost.model = SurveyedModel::nonlinear_zone;
  constexpr std::uint64_t kOperationsOfDof = 12;  // for the forces of an element
  cost.force_operations = kIterations * (m * m + boundary * boundary + elements * kOperationsOfDof * dofs);
  cost.force_bytes = static_cast<std::uint64_t>(content.zone->most_nodes) * sizeof(pack::OrganNode);
  // A field reads the last result of the refining lane, and three columns for each node of the patch.
  std::uint64_t patch = 0;
  for (const ContactSite& site : content.sites.sites)
    patch = std::max<std::uint64_t>(patch, site.patch_nodes.size());
  cost.field_operations = rows * 3 * patch;
  cost.field_bytes = rows * (1 + 3 * patch) * sizeof(pack::Real);
  return cost;
}

FrameCost polynomial_cost(const PackContent& content, std::uint64_t rows) {
  // Counts six Hessian entries, a product each, for each monomial two degrees below a term of the energy.
  FrameCost cost;
  cost.model = SurveyedModel::polynomial_dd;
  for (const SiteResult& result : *content.polynomials) {
    const auto degree = static_cast<uint32_t>(result.polynomial.degree);
    const auto rank = static_cast<uint32_t>(result.polynomial.basis.cols());
    const std::uint64_t field_terms = std::uint64_t{rank} * pack::num_monomials(2, degree);
    cost.force_operations =
        std::max<std::uint64_t>(cost.force_operations, std::uint64_t{7} * pack::num_monomials(0, degree - 1));
    cost.force_bytes =
        std::max<std::uint64_t>(cost.force_bytes, pack::num_monomials(2, degree + 1) * sizeof(double));
    cost.field_operations = std::max(cost.field_operations, rows * (3 + rank) + field_terms);
    cost.field_bytes = std::max<std::uint64_t>(
        cost.field_bytes, rows / pack::kPanelRows * pack::field_panel_bytes(3 + rank, content.rounded) +
                              field_terms * sizeof(pack::Real));
  }
  return cost;
}

}  // namespace

std::vector<FrameCost> count_frame_costs(const PackContent& content) {
  const std::uint64_t rows = pack::num_panels(static_cast<uint32_t>(content.sites.packed_nodes.size())) *
                             std::uint64_t{pack::kPanelRows};
  std::vector<FrameCost> costs;
  if (content.has_linear()) costs.push_back(linear_cost(content, rows));
  if (content.zone != nullptr) costs.push_back(zone_cost(content, rows));
  if (content.polynomials != nullptr) costs.push_back(polynomial_cost(content, rows));
  return costs;
}

}  // namespace palpate
