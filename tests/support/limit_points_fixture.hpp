// Helpers for equilibrium paths past limit points.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "offline/mesh/element_faces.hpp"
#include "tests/support/arch_rod.hpp"
#include "tests/support/elastica.hpp"
#include "tests/support/limit_scenes.hpp"

namespace palpate::limit_points_fixture {

using test::PathRun;
using test::PathScene;
// Residual of equilibrium: |f_ext - P| over the free dofs, over the largest load of the path.
inline double imbalance(const PathScene& scene, const LoadCase& load, const Eigen::VectorXd& displacement,
                        double force) {
  const Assembly assembly(scene.model, scene.model.fixed_dofs());
  Eigen::VectorXd internal;
  assembly.internal_force(displacement, internal);
  Eigen::VectorXd external = load.force;
  add_pressure_force(scene.model, load.pressures, displacement, external);
  double sum = 0;
  for (int dof = 0; dof < scene.model.num_dofs(); ++dof) {
    if (!load.held[static_cast<size_t>(dof)]) sum += std::pow(external[dof] - internal[dof], 2);
  }
  return std::sqrt(sum) / force;
}

inline LoadCase times(LoadCase load, double factor) {
  load.force *= factor;
  load.displacement *= factor;
  for (auto& [face, pressure] : load.pressures) pressure *= factor;
  return load;
}

// Tests that both kinds of stepping must pass: the loaded point never snaps back.
class LimitPointsBy : public ::testing::TestWithParam<Stepping> {};

}  // namespace palpate::limit_points_fixture
