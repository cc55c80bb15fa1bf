#include "offline/pipeline/compliance_errors.hpp"

#include <algorithm>
#include <random>

#include "offline/precompute/linear_contacts.hpp"
#include "offline/precompute/linear_dd.hpp"

namespace palpate {

ComplianceErrors measure_compliance(const OpenedPack& opened, const Assembly& assembly,
                                    const ContactSites& sites, const RestState& rest, int max_contacts) {
  constexpr int kSets = 24;
  StaticSolver solver(assembly);
  factor_at_rest(solver, rest);
  const int most = std::min(max_contacts, static_cast<int>(sites.sites.size()));
  ModelUnitSession session(opened, PAL_MODEL_LINEAR, static_cast<std::uint32_t>(most), 0);
  const Eigen::VectorXd at_rest = session.visual_frame();
  std::mt19937 random(1);
  const auto uniform = [&] { return 2.0 * (static_cast<double>(random()) + 0.5) / 4294967296.0 - 1.0; };
  ComplianceErrors errors;
  for (; errors.samples < kSets; ++errors.samples) {
    std::vector<LinearContact> contacts;
    std::vector<pal_contact> runtime_contacts;
    double largest = 0;
    for (int c = 0; c <= errors.samples % most; ++c) {
      LinearContact contact;
      contact.site = random() % sites.sites.size();
      for (double& component : contact.displacement) component = uniform();
      largest = std::max(largest, contact.displacement.norm());
      const Eigen::Vector3d& d = contact.displacement;
      runtime_contacts.push_back(
          {static_cast<std::uint32_t>(contact.site), {d[0], d[1], d[2]}, 0, {}, {}, {}});
      contacts.push_back(contact);
    }
    const LinearContactAnswer exact = solve_contacts(solver, sites, contacts);
    const std::vector<pal_contact_result> results = session.contact_frame(runtime_contacts);
    double largest_force = 0;
    for (const Eigen::Vector3d& force : exact.forces) largest_force = std::max(largest_force, force.norm());
    for (size_t c = 0; c < contacts.size(); ++c) {
      errors.force = std::max(errors.force,
                              (Eigen::Vector3d(results[c].force) - exact.forces[c]).norm() / largest_force);
    }
    const Eigen::VectorXd difference = session.visual_frame() - at_rest - exact.field;
    for (Eigen::Index node = 0; node < difference.size() / 3; ++node)
      errors.displacement = std::max(errors.displacement, difference.segment<3>(3 * node).norm() / largest);
  }
  return errors;
}

}  // namespace palpate
