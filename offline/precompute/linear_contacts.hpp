// The exact linear response to several contacts, from their own columns of K^-1: the reference for a
// compressed compliance.
//
// As the runtime's linear_dd (Zhong et al. 2005 eqs. (16)-(20)): f = A^-1 E d, u = C f, with A the blocks of
// K^-1 at all patch nodes. A node of several patches follows the mean of their displacements.
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

// `solver` holds the factor at rest. Cost: a back-solve for each dof of the patches.
LinearContactAnswer solve_contacts(StaticSolver& solver, const ContactSites& sites,
                                   const std::vector<LinearContact>& contacts);

}  // namespace palpate
