// Rows of least-squares systems for polynomials of three variables known by value and derivatives at points.
#pragma once

#include <Eigen/Core>

namespace palpate {

// How much a derivative of `order` counts beside a value when a polynomial of `degree` is fitted to a smooth
// function. What the fit leaves out begins with degree + 1, and there the first derivative is degree + 1 times
// the value, the second degree times that: with less weight than this derivatives would not help, with more
// they would bend the fit (on the brain at 1 h, degree 3, a weight of 1 for first ones gives 1.1 % at worst, of
// 1/4 0.7 %).
inline double derivative_weight(int degree, int order) {
  double weight = 1;
  for (int i = 0; i < order; ++i) weight /= degree + 1 - i;
  return weight;
}

// For each row of hermite_rows. A derivative counts as one of `wanted` less: where those of order `wanted` are what the
// fit is for, lower ones count like them.
Eigen::VectorXd derivative_weights(int degree, int order, int wanted = 0);

// The monomials of degrees first .. last (columns, in the order of a pack) at x, and their partial derivatives
// up to `order` (rows: the derivative by x^a y^b z^c where a pack has the monomial x^a y^b z^c: value; x y z; xx
// xy xz yy yz zz; ...): num_monomials(0, order) rows.
Eigen::MatrixXd hermite_rows(const Eigen::Vector3d& x, int first, int last, int order);

}  // namespace palpate
