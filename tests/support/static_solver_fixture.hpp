// A block and its loads, for the tests of the static solver.
#pragma once

#include "offline/fem/static_solver.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tests/support/tetrahedral_block.hpp"

namespace palpate::static_solver_fixture {

using test::BlockShape;
using test::nodes_on_plane;
using test::tetrahedral_block;
using test::with_fixed_base;
// Two solves to the default tolerance of 1e-10 stop at different points; bounds displacements and forces.
inline constexpr double kSameAnswer = 1e-9;

// A unit block on a fixed base.
inline Model organ() {
  return with_fixed_base(tetrahedral_block(BlockShape()));
}

inline std::vector<int> top_of(const Model& model) {
  double highest = 0;
  for (const Eigen::Vector3d& position : model.positions) highest = std::max(highest, position.z());
  return nodes_on_plane(model, 2, highest);
}

// The top moves rigidly by `motion`.
inline LoadCase moved_top(const Model& model, const Eigen::Vector3d& motion) {
  LoadCase load = LoadCase::rest(model);
  for (const int node : top_of(model)) {
    for (int axis = 0; axis < 3; ++axis) {
      load.held[static_cast<size_t>(3 * node + axis)] = 1;
      load.displacement[3 * node + axis] = motion[axis];
    }
  }
  return load;
}

// The nodes of the top share the force `total`.
inline LoadCase pulled_top(const Model& model, const Eigen::Vector3d& total) {
  LoadCase load = LoadCase::rest(model);
  const std::vector<int> top = top_of(model);
  for (const int node : top) load.force.segment<3>(3 * node) = total / static_cast<double>(top.size());
  return load;
}

// Residual: |f_ext - P| over the free dofs, over |P| at the held dofs plus |f_ext|.
inline double imbalance(const Assembly& assembly, const LoadCase& load, const Eigen::VectorXd& displacement) {
  Eigen::VectorXd force;
  assembly.internal_force(displacement, force);
  double free = 0;
  double held = 0;
  double applied = 0;
  for (int dof = 0; dof < assembly.num_dofs(); ++dof) {
    if (load.held[static_cast<size_t>(dof)]) {
      held += force[dof] * force[dof];
    } else {
      free += std::pow(load.force[dof] - force[dof], 2);
      applied += load.force[dof] * load.force[dof];
    }
  }
  return std::sqrt(free) / (std::sqrt(held) + std::sqrt(applied));
}

inline const Eigen::Vector3d kPush(0.15, 0.05, -0.3);

inline const Eigen::Vector3d kPull(0.03, 0.0, 0.12);

}  // namespace palpate::static_solver_fixture
