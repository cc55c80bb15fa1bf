// The exact linear answer of several contacts, by columns of K^-1 made for them alone: what a compressed
// compliance is measured against.
//
// As linear_dd of the runtime (Zhong et al. 2005 eqs. (16)-(20)): f = A^-1 E d with A the blocks of K^-1 at the
// nodes of all patches, u = C f. A node of several patches follows their mean.
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

// `solver` has the factor at rest. Cost: a back-solve for each dof of the patches.
LinearContactAnswer solve_contacts(StaticSolver& solver, const ContactSites& sites,
                                   const std::vector<LinearContact>& contacts);

}  // namespace palpate
