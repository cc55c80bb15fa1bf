// Rows of least-squares systems for polynomials of three variables with known values and derivatives.
#pragma once

#include <Eigen/Core>

namespace palpate {

// Weight of a derivative of `order` relative to a value in a fit of `degree`. The fit's remainder starts at
// degree + 1, where the first derivative is degree + 1 times the value, and the second degree times more.
// Less weight wastes the derivatives; more weight distorts the fit.
inline double derivative_weight(int degree, int order) {
  double weight = 1;
  for (int i = 0; i < order; ++i) weight /= degree + 1 - i;
  return weight;
}

// Weights for each row of hermite_rows(). Derivatives up to order `wanted` count as values: the fit serves
// order `wanted`.
Eigen::VectorXd derivative_weights(int degree, int order, int wanted = 0);

// Monomials of degrees first .. last (columns, in the order of a pack) at x and their partial derivatives up
// to `order` (rows, in the same order: value; x y z; xx xy xz yy yz zz; ...): num_monomials(0, order) rows.
Eigen::MatrixXd hermite_rows(const Eigen::Vector3d& x, int first, int last, int order);

}  // namespace palpate
