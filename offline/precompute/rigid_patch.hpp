// The linear organ at rest with one rigid patch: its response to forces at the patch and to nodal loads.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

#include "offline/fem/static_solver.hpp"
#include "offline/precompute/contact_sites.hpp"

namespace palpate {

// Solves nodal loads (num_dofs rows) for displacements with the Cholesky factor at rest of `solver`.
void solve_at_rest(StaticSolver& solver, Eigen::MatrixXd& columns);

class RigidPatch {
 public:
  // `solver` holds a factor at rest. Cost: 3 back-solves for each node of the patch.
  RigidPatch(StaticSolver& solver, const ContactSite& site);

  // Net force per displacement of the patch.
  const Eigen::Matrix3d& stiffness() const { return stiffness_; }

  // Displacements per unit force along each axis, num_dofs x 3.
  Eigen::MatrixXd per_force() const;

  // Makes the patch rigid in `loaded` (num_dofs rows), the response to nodal loads with free patch nodes.
  Eigen::MatrixXd tied(const Eigen::MatrixXd& loaded) const;

 private:
  std::vector<Eigen::Index> dofs_;
  Eigen::MatrixXd columns_;  // columns of K^-1 at the patch's dofs
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::MatrixXd forces_;  // nodal, per displacement of the patch
  Eigen::Matrix3d stiffness_;
};

// Step for differences of K along fields per x = force / force_scale; gives about 7 digits.
double difference_step(const RigidPatch& patch, double force_scale, double mean_surface_edge);

}  // namespace palpate
