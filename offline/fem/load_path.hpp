// The loads of a step over its time, continuous with the equilibrium at its start.
#pragma once

#include <Eigen/Core>
#include <functional>

#include "offline/fem/load_case.hpp"

namespace palpate {

// At time 0 the path has the loads and reactions of the start. The difference between the start and loads(0)
// ramps out linearly over the step:
//   1. a newly held dof moves from its current place,
//   2. the reaction of a released dof decays,
//   3. a load of constant size in loads(t) grows.
// The dofs held by loads(1) are held at all times.
class LoadPath {
 public:
  // `displacement` is the equilibrium of `from`; `internal` are its internal forces.
  LoadPath(const LoadCase& from, const std::function<LoadCase(double)>& loads, const Model& model,
           const Eigen::VectorXd& displacement, const Eigen::VectorXd& internal);

  // Returns the loads at time 0 .. 1; at(1) equals loads(1) to the bit. Constant loads extrapolate above 1.
  LoadCase at(double time) const;

 private:
  std::function<LoadCase(double)> loads_;
  std::vector<char> held_;
  Eigen::VectorXd displacement_offset_;
  Eigen::VectorXd force_offset_;
  FacePressures pressure_offset_;
};

}  // namespace palpate
