// Rows of least-squares systems for polynomials of three variables known by value, gradient and Hessian at
// points.
#pragma once

#include <Eigen/Core>

namespace palpate {

// How much a derivative counts beside a value when a polynomial of `degree` is fitted to a smooth function.
// What the fit leaves out begins with degree + 1, and there a derivative is degree + 1 times the value: with
// less weight than this the derivatives would not help, with more they would bend the fit (on the brain at 1
// h, degree 3, a weight of 1 gives 1.1 % at worst, of 1/4 0.7 %).
inline double derivative_weight(int degree) {
  return 1.0 / (degree + 1);
}

// Value, d/dx, d/dy, d/dz (4 rows) of the monomials of degrees first .. last (columns, in the order of a
// pack).
Eigen::MatrixXd hermite_rows(const Eigen::Vector3d& x, int first, int last);

// Value (1), gradient (3) and second derivatives xx xy xz yy yz zz (6) of the same monomials: 10 rows.
Eigen::MatrixXd hermite_rows_second_order(const Eigen::Vector3d& x, int first, int last);

}  // namespace palpate
