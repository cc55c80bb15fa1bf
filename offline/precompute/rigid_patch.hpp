// How the linear organ at rest answers forces at a patch whose nodes move as one, and nodal loads elsewhere.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

#include "offline/fem/static_solver.hpp"
#include "offline/precompute/contact_sites.hpp"

namespace palpate {

// Nodal loads (num_dofs x any) to displacements, by the Cholesky factor at rest that `solver` holds.
void solve_at_rest(StaticSolver& solver, Eigen::MatrixXd& columns);

class RigidPatch {
 public:
  // `solver` holds a factor at rest. Cost: 3 back-solves for each node of the patch.
  RigidPatch(StaticSolver& solver, const ContactSite& site);

  // Net force per displacement of the patch.
  const Eigen::Matrix3d& stiffness() const { return stiffness_; }

  // Displacements per unit force along each axis, num_dofs x 3.
  Eigen::MatrixXd per_force() const;

  // What `loaded` (num_dofs x any), the answer to nodal loads with the nodes of the patch let go, becomes where they
  // are tied to one another.
  Eigen::MatrixXd tied(const Eigen::MatrixXd& loaded) const;

 private:
  std::vector<Eigen::Index> dofs_;
  Eigen::MatrixXd columns_;  // of K^-1, of those dofs
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::MatrixXd forces_;  // nodal, per displacement of the patch
  Eigen::Matrix3d stiffness_;
};

// Of fields per x = force / force_scale: how much of them a difference of K steps over, to be good to about 1e-7.
double difference_step(const RigidPatch& patch, double force_scale, double mean_surface_edge);

}  // namespace palpate
