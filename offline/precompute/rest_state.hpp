// The organ's state before contact: the stress-free mesh, or its equilibrium under gravity.
//
// Under gravity rest is the equilibrium P(u) = b(g) of the full nonlinear model, b_a = int N_a rho g dV.
// Contacts are linearised and sampled about rest. When the device tilts, g rotates; to first order
//
//   u(g) = u(g0) + G (g - g0),   G = K^-1 db/dg, three columns, K the tangent at rest
//
// This equation is exact for a linear organ: Zhong et al. 2005 eq. (16) with b for f.
#pragma once

#include <Eigen/Core>

#include "offline/fem/static_solver.hpp"
#include "offline/precompute/scene.hpp"

namespace palpate {

struct RestState {
  // All members are empty without gravity.
  Eigen::VectorXd displacement;  // from the mesh: num_dofs
  Eigen::VectorXd force;         // b: num_dofs
  Eigen::MatrixXd per_gravity;   // G: num_dofs x 3, only where the device may tilt
  double energy = 0;             // potential energy at rest: stored energy - b . u

  bool is_mesh() const { return displacement.size() == 0; }
  Eigen::VectorXd displacement_of(const Model& model) const {
    return is_mesh() ? Eigen::VectorXd::Zero(model.num_dofs()) : displacement;
  }
  LoadCase load_case(const Model& model) const;
};

// Solves for rest. Throws std::runtime_error where the solver finds no stable equilibrium.
RestState find_rest(const Assembly& assembly, const Scene& scene);

}  // namespace palpate
