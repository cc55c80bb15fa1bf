// Full nonlinear solutions for several simultaneous contacts: the truth, to which all models are compared.
#pragma once

#include <functional>
#include <vector>

#include "offline/precompute/linear_contacts.hpp"
#include "offline/precompute/rest_state.hpp"

namespace palpate {

// The truth of one set of contacts.
struct ContactTruth {
  std::vector<LinearContact> contacts;
  bool solved = false;                  // false: no equilibrium found; the other members are empty
  Eigen::VectorXd field;                // u at the packed nodes, from rest: 3 packed nodes
  std::vector<Eigen::Vector3d> forces;  // from the tools on the tissue
  double largest_displacement() const;  // largest |d| of the contacts; length unit
};

// Returns the load at rest with the patches held at these displacements from rest. Patches are disjoint.
LoadCase held_patches(const Model& model, const ContactSites& sites, const RestState& rest,
                      const std::vector<LinearContact>& contacts);

// Returns the net contact force on the patch of `site` at the displacements u (all dofs), relative to rest.
Eigen::Vector3d patch_force(const Assembly& assembly, const RestState& rest, const ContactSite& site,
                            const Eigen::VectorXd& u);

// Solves one set of contacts: all displacements ramp together from rest. Adds its iterations to `iterations`.
ContactTruth solve_contact_set(StaticSolver& solver, const ContactSites& sites, const RestState& rest,
                               const std::vector<LinearContact>& contacts, long& iterations);

// Solves all sets on `jobs` threads; the result, in the order of `sets`, does not depend on threads.
// `progress` gets done and total sets, from one thread at a time.
std::vector<ContactTruth> solve_contact_sets(const Assembly& assembly, const ContactSites& sites,
                                             const std::vector<std::vector<LinearContact>>& sets, int jobs,
                                             const RestState& rest,
                                             const std::function<void(int, int)>& progress = {});

}  // namespace palpate
