// The full nonlinear answer to several contacts at once: what a model's answers to them are measured against.
#pragma once

#include <functional>
#include <vector>

#include "offline/precompute/linear_contacts.hpp"
#include "offline/precompute/rest_state.hpp"

namespace palpate {

// One truth and where it was measured.
struct ContactTruth {
  std::vector<LinearContact> contacts;
  bool solved = false;                  // false: no equilibrium was found, and the rest is empty
  Eigen::VectorXd field;                // u at the packed nodes, from rest: 3 packed nodes
  std::vector<Eigen::Vector3d> forces;  // that the tools apply
  double largest_displacement() const;  // of a contact; length unit
};

// The organ at rest, with the patches of these contacts held at their displacements from there. No two of them share a
// node.
LoadCase held_patches(const Model& model, const ContactSites& sites, const RestState& rest,
                      const std::vector<LinearContact>& contacts);

// The net force that the outside applies to the patch of `site` in the state u (all dofs).
Eigen::Vector3d patch_force(const Assembly& assembly, const RestState& rest, const ContactSite& site,
                            const Eigen::VectorXd& u);

// The truth of one set of contacts: all displacements ramp together from rest. Adds to `iterations` what that took.
ContactTruth solve_contact_set(StaticSolver& solver, const ContactSites& sites, const RestState& rest,
                               const std::vector<LinearContact>& contacts, long& iterations);

// The truth of each set of contacts, in their order, on `jobs` threads; the result does not depend on how many.
// `progress` gets sets done, total, never from two threads at once.
std::vector<ContactTruth> solve_contact_sets(const Assembly& assembly, const ContactSites& sites,
                                             const std::vector<std::vector<LinearContact>>& sets, int jobs,
                                             const RestState& rest,
                                             const std::function<void(int, int)>& progress = {});

}  // namespace palpate
