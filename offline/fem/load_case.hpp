// The loads and prescribed displacements on the body in one state.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "offline/fem/surface_pressure.hpp"

namespace palpate {

// Held dofs and their displacements, forces on free dofs, pressures on faces. Vectors have num_dofs entries.
struct LoadCase {
  std::vector<char> held;        // 1 at held dofs, else 0
  Eigen::VectorXd displacement;  // valid at held dofs; length unit
  Eigen::VectorXd force;         // valid at free dofs; force unit
  FacePressures pressures;       // follow their faces

  // Returns a case without loads in which the dofs of `model.fixed` are held at zero.
  static LoadCase rest(const Model& model);
};

}  // namespace palpate
