// The exact linear response to several contacts: the reference for a compressed compliance.
//
// Zhong et al. 2005 eqs. (16)-(20), as in the runtime: f = A^-1 E d, u = C f. C: columns of K^-1 at the patch
// nodes, A: their rows there, E d: displacements of the patch nodes, means where patches share a node.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "offline/fem/static_solver.hpp"
#include "offline/precompute/contact_sites.hpp"

namespace palpate {

struct LinearContact {
  size_t site = 0;
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();
};

struct LinearContactAnswer {
  Eigen::VectorXd field;  // 3 packed nodes
  std::vector<Eigen::Vector3d> forces;
};

// Solves all contacts together with the factor at rest in `solver`. Cost: a back-solve for each patch dof.
LinearContactAnswer solve_contacts(StaticSolver& solver, const ContactSites& sites,
                                   const std::vector<LinearContact>& contacts);

}  // namespace palpate
