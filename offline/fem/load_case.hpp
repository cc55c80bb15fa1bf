// What the outside does to the body in one state.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "offline/fem/surface_pressure.hpp"

namespace palpate {

// Held degrees of freedom with their displacements, forces on the others, pressures on faces. The first three
// are num_dofs long.
struct LoadCase {
  std::vector<char> held;
  Eigen::VectorXd displacement;  // read where held; length unit
  Eigen::VectorXd force;         // read where not held; force unit
  FacePressures pressures;       // follow their faces

  // Nothing loaded, `model.fixed` held at zero.
  static LoadCase rest(const Model& model);
};

}  // namespace palpate
