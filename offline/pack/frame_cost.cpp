#include "offline/pack/frame_cost.hpp"

#include <algorithm>

#include "schemas/monomials.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {

std::vector<FrameCost> count_frame_costs(const PackContent& content) {
  const std::uint64_t rows = pack::num_panels(static_cast<uint32_t>(content.sites.packed_nodes.size())) *
                             std::uint64_t{pack::kPanelRows};
  std::vector<FrameCost> costs;
  if (content.linear != nullptr) {
    // A new contact: the compliance of its n patch dofs is gathered and factored (n^3/6), three columns are
    // solved (n^2 each, forth and back), then summed to the 3 x 3 stiffness (3 n) and, by the displacement,
    // to the n nodal forces (3 n) and the force (9).
    size_t largest = 0;
    for (const ContactSite& site : content.sites.sites) largest = std::max(largest, site.patch.size());
    const std::uint64_t n = 3 * largest;
    FrameCost cost;
    cost.model = SurveyedModel::linear_dd;
    cost.force_operations = n * n * n / 6 + 3 * n * n + 6 * n + 9;
    cost.force_bytes = n * (n + 1) / 2 * sizeof(double);
    cost.field_operations = rows * n;
    cost.field_bytes = rows * n * sizeof(float);
    costs.push_back(cost);
  }
  if (content.polynomials != nullptr) {
    // Each energy term enters the value, three first and six second derivatives, with two products each.
    const std::uint64_t energy_terms = pack::num_monomials(2, static_cast<uint32_t>(content.degree) + 1);
    const std::uint64_t field_terms = pack::num_monomials(1, static_cast<uint32_t>(content.degree));
    FrameCost cost;
    cost.model = SurveyedModel::polynomial_dd;
    cost.force_operations = 20 * energy_terms;
    cost.force_bytes = energy_terms * sizeof(double);
    cost.field_operations = rows * field_terms;
    cost.field_bytes = rows * field_terms * sizeof(float);
    costs.push_back(cost);
  }
  return costs;
}

}  // namespace palpate
