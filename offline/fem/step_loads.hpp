// The loads of one *STEP over its time, as forces at nodes: gravity, tractions, and at small strain pressures
// are put on the nodes of the body at rest by its shape functions.
//
// Source: Zhong et al. 2005 eqs. (7) to (9): f_a = sum over elements of int N_a rho b dV + sum over faces of
// int N_a t dS.
#pragma once

#include <map>

#include "offline/fem/load_case.hpp"

namespace palpate {

class StepLoads {
 public:
  // Keeps references to both.
  StepLoads(const Model& model, const Step& step);

  // At a fraction 0 .. 1 of the step's time. A load without amplitude has its value at once: to let it ramp
  // is the business of StaticSolver::follow.
  LoadCase at(double fraction) const;

 private:
  double factor(int amplitude, double fraction) const;

  const Model* model_;
  const Step* step_;
  std::map<int, Eigen::VectorXd> forces_;  // those of each amplitude
};

}  // namespace palpate
