// Reference response of contacts between sites: the weighted sum of site responses. The sum runs over every
// choice of one corner for each contact.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "runtime/src/session/session_state.hpp"
#include "tests/support/runtime_session.hpp"

namespace palpate::test {

struct BlendedAnswers {
  std::vector<Eigen::Vector3d> forces;
  std::vector<Eigen::Matrix3d> stiffness;
  Eigen::VectorXd field;
  double energy = 0;
};

inline void add_answers(OwnedSession& at_sites, const std::vector<pal_contact>& contacts, size_t first,
                        double weight, BlendedAnswers& sum) {
  if (first == contacts.size()) {
    const auto results = at_sites.touch(contacts);
    const Eigen::VectorXd field = as_vector(at_sites.field());
    if (sum.forces.empty()) {
      sum.forces.assign(contacts.size(), Eigen::Vector3d::Zero());
      sum.stiffness.assign(contacts.size(), Eigen::Matrix3d::Zero());
      sum.field.setZero(field.size());
    }
    for (size_t c = 0; c < contacts.size(); ++c) {
      sum.forces[c] += weight * Eigen::Vector3d(results[c].force);
      sum.stiffness[c] += weight * Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(
                                       &results[c].stiffness[0][0]);
    }
    sum.field += weight * field;
    sum.energy += weight * at_sites.get()->tissue.stored_energy;
    return;
  }
  const pal_contact contact = contacts[first];
  const double* others = contact.neighbour_weights;
  const std::pair<uint32_t, double> corners[3] = {{contact.site, 1 - others[0] - others[1]},
                                                  {contact.neighbours[0], others[0]},
                                                  {contact.neighbours[1], others[1]}};
  for (const auto& [site, of_corner] : corners) {
    if (!(of_corner > 0)) continue;
    std::vector<pal_contact> with = contacts;
    with[first].site = site;
    with[first].neighbour_weights[0] = with[first].neighbour_weights[1] = 0;
    add_answers(at_sites, with, first + 1, weight * of_corner, sum);
  }
}

// `at_sites` receives only contacts at sites.
inline BlendedAnswers blend_answers(OwnedSession& at_sites, const std::vector<pal_contact>& contacts) {
  BlendedAnswers sum;
  add_answers(at_sites, contacts, 0, 1, sum);
  return sum;
}

}  // namespace palpate::test
