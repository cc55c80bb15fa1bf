// The loads and prescribed displacements on the body in one state.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "offline/fem/surface_pressure.hpp"

namespace palpate {

// Held dofs with their displacements, forces on free dofs, pressures on faces. The first three members have
// num_dofs entries.
struct LoadCase {
  std::vector<char> held;
  Eigen::VectorXd displacement;  // valid at held dofs; length unit
  Eigen::VectorXd force;         // valid at free dofs; force unit
  FacePressures pressures;       // follow their faces

  // No loads; `model.fixed` is held at zero.
  static LoadCase rest(const Model& model);
};

}  // namespace palpate
