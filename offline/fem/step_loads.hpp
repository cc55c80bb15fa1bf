// The loads of one *STEP over its time as nodal forces. Shape functions distribute gravity, tractions and, at
// small strain, pressures over the nodes at rest.
//
// Source: Zhong et al. 2005 eqs. (7) to (9): f_a = sum_elements int N_a rho b dV + sum_faces int N_a t dS.
#pragma once

#include <map>

#include "offline/fem/load_case.hpp"

namespace palpate {

class StepLoads {
 public:
  // Keeps references to `model` and `step`.
  StepLoads(const Model& model, const Step& step);

  // Returns the loads at a fraction 0 .. 1 of the step. StaticSolver::follow ramps loads without amplitude.
  LoadCase at(double fraction) const;

 private:
  double factor(int amplitude, double fraction) const;  // of the loads with this amplitude

  const Model* model_;
  const Step* step_;
  std::map<int, Eigen::VectorXd> forces_;  // by amplitude
};

}  // namespace palpate
