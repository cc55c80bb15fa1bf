// The loads of a step over its time, joined to the equilibrium that it starts from.
#pragma once

#include <Eigen/Core>
#include <functional>

#include "offline/fem/load_case.hpp"

namespace palpate {

// At time 0 it does what the outside does at the start, reactions included; where the step's own loads(0) is
// something else, the difference ramps out over the step: a dof newly held moves from where it is, the
// reaction of one that is released dies away, a load that stands in loads(t) at its full size all the time
// grows linearly. Held are always the dofs that loads(1) holds.
class LoadPath {
 public:
  // `displacement` is the equilibrium of `from`, with the internal forces `internal`.
  LoadPath(const LoadCase& from, const std::function<LoadCase(double)>& loads, const Model& model,
           const Eigen::VectorXd& displacement, const Eigen::VectorXd& internal);

  // Time in [0, 1], at 1 to the bit what the step's loads say; where those are the same at all times also
  // beyond, along the same line.
  LoadCase at(double time) const;

 private:
  std::function<LoadCase(double)> loads_;
  std::vector<char> held_;
  Eigen::VectorXd displacement_offset_;
  Eigen::VectorXd force_offset_;
  FacePressures pressure_offset_;
};

}  // namespace palpate
