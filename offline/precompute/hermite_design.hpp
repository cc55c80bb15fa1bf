// Rows of least-squares systems that fit polynomials of three variables to values and derivatives.
#pragma once

#include <Eigen/Core>

namespace palpate {

// Returns the weight of a derivative of `order` relative to a value in a fit of `degree`. The remainder
// starts at degree + 1: its first derivative is degree + 1 times its value, the second derivative degree
// times the first. Less weight wastes the derivatives; more weight distorts the fit.
inline double derivative_weight(int degree, int order) {
  double weight = 1;
  for (int i = 0; i < order; ++i) weight /= degree + 1 - i;
  return weight;
}

// Returns a weight for each row of hermite_rows(): 1 up to order `wanted`, which the fit serves.
Eigen::VectorXd derivative_weights(int degree, int order, int wanted = 0);

// Returns the monomials of degrees first .. last (columns, in the order of a pack) at x and their partial
// derivatives up to `order` (rows, in the same order: value; x y z; xx xy xz yy yz zz; ...).
Eigen::MatrixXd hermite_rows(const Eigen::Vector3d& x, int first, int last, int order);

}  // namespace palpate
