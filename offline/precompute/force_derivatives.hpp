// Derivatives of the internal force P at rest along three fields u_a, as matrices:
//   n2(u_a, v) = d/ds K(s u_a) v,   n3(u_a, u_b, v) = d^2/ds dt K(s u_a + t u_b) v        at s = t = 0
// by central differences of the assembled K = dP/du.
#pragma once

#include <Eigen/Core>
#include <array>

#include "offline/fem/assembly.hpp"

namespace palpate {

class ForceDerivatives {
 public:
  // `fields`: num_dofs x 3, scaled to the step of the differences. Cost: six assemblies of K, thirteen for
  // third order. Memory: three triangles of K, or nine.
  ForceDerivatives(const Assembly& assembly, const Eigen::VectorXd& at_rest, const Eigen::MatrixXd& fields,
                   double step, bool to_third_order);

  // n2(u_a, v) and n3(u_a, u_b, v) of columns v (num_dofs rows); zero at eliminated dofs. Cost: one
  // multiply-add for each entry of K and column.
  Eigen::MatrixXd second(int a, const Eigen::MatrixXd& v) const;
  Eigen::MatrixXd third(int a, int b, const Eigen::MatrixXd& v) const;

 private:
  Eigen::MatrixXd times(const SparseLower& matrix, const Eigen::MatrixXd& v) const;

  const Assembly* assembly_;
  std::array<SparseLower, 3> second_;
  std::array<SparseLower, 6> third_;  // pairs 00, 10, 11, 20, 21, 22
};

}  // namespace palpate
