#include "offline/precompute/contact_truth.hpp"

#include <algorithm>

#include "offline/precompute/solver_threads.hpp"

namespace palpate {

double ContactTruth::largest_displacement() const {
  double largest = 0;
  for (const LinearContact& contact : contacts) largest = std::max(largest, contact.displacement.norm());
  return largest;
}

LoadCase held_patches(const Model& model, const ContactSites& sites, const RestState& rest,
                      const std::vector<LinearContact>& contacts) {
  LoadCase load = rest.load_case(model);
  for (const LinearContact& contact : contacts) {
    for (const int node : sites.sites[contact.site].patch_nodes) {
      for (int axis = 0; axis < 3; ++axis) {
        const int dof = 3 * node + axis;
        load.held[static_cast<size_t>(dof)] = 1;
        load.displacement[dof] = contact.displacement[axis] + (rest.is_mesh() ? 0.0 : rest.displacement[dof]);
      }
    }
  }
  return load;
}

Eigen::Vector3d patch_force(const Assembly& assembly, const RestState& rest, const ContactSite& site,
                            const Eigen::VectorXd& u) {
  Eigen::VectorXd internal;
  assembly.internal_force(u, internal);
  if (!rest.is_mesh()) internal -= rest.force;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  for (const int node : site.patch_nodes) force += internal.segment<3>(3 * node);
  return force;
}

ContactTruth solve_contact_set(StaticSolver& solver, const ContactSites& sites, const RestState& rest,
                               const std::vector<LinearContact>& contacts, long& iterations) {
  const Assembly& assembly = solver.assembly();
  const Model& model = assembly.model();
  const Eigen::VectorXd at_rest = rest.displacement_of(model);
  ContactTruth truth;
  truth.contacts = contacts;
  std::vector<LinearContact> untouched = contacts;
  for (LinearContact& contact : untouched) contact.displacement.setZero();
  Eigen::VectorXd u = at_rest;
  solver.forget_factor();
  const SolveReport report = solver.ramp(held_patches(model, sites, rest, untouched),
                                         held_patches(model, sites, rest, contacts), u, SolverSettings());
  iterations += report.iterations;
  truth.solved = report.converged;
  if (!truth.solved) return truth;
  truth.field = packed_rows(sites, u - at_rest);
  for (const LinearContact& contact : contacts)
    truth.forces.push_back(patch_force(assembly, rest, sites.sites[contact.site], u));
  return truth;
}

std::vector<ContactTruth> solve_contact_sets(const Assembly& assembly, const ContactSites& sites,
                                             const std::vector<std::vector<LinearContact>>& sets, int jobs,
                                             const RestState& rest,
                                             const std::function<void(int, int)>& progress) {
  std::vector<ContactTruth> truths(sets.size());
  for_each_on_threads(
      assembly, sets.size(), jobs,
      [&](StaticSolver& solver, size_t i) {
        long iterations = 0;
        truths[i] = solve_contact_set(solver, sites, rest, sets[i], iterations);
      },
      progress);
  return truths;
}

}  // namespace palpate
