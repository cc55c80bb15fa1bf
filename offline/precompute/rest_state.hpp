// The state in which a tool finds the organ: the mesh free of stress, or what gravity has made of it.
//
// Under gravity rest is the equilibrium P(u) = b(g) of the full nonlinear model, b_a = int N_a rho g dV, and
// what contacts add is linearised and sampled about it. While the device is tilted, g turns; to first order
// the organ then moves by
//
//   u(g) = u(g0) + G (g - g0),   G = K^-1 db/dg, three columns, K the tangent at rest
//
// which is all of it for a linear organ, Zhong et al. 2005 eq. (16) with b for f.
#pragma once

#include <Eigen/Core>

#include "offline/fem/static_solver.hpp"
#include "offline/precompute/scene.hpp"

namespace palpate {

struct RestState {
  // All empty without gravity.
  Eigen::VectorXd displacement;  // from the mesh: num_dofs
  Eigen::VectorXd force;         // b: num_dofs
  Eigen::MatrixXd per_gravity;   // G: num_dofs x 3, only where the device may turn it
  double energy = 0;             // stored energy - b . u

  bool is_mesh() const { return displacement.size() == 0; }
  Eigen::VectorXd displacement_of(const Model& model) const {
    return is_mesh() ? Eigen::VectorXd::Zero(model.num_dofs()) : displacement;
  }
  LoadCase load_case(const Model& model) const;
};

// Throws std::runtime_error where no equilibrium is found.
RestState find_rest(const Assembly& assembly, const Scene& scene);

}  // namespace palpate
