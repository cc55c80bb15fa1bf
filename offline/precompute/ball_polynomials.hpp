// Orthonormal polynomials of three variables over the unit ball. They condition least squares, and a
// coefficient equals its term's size.
#pragma once

#include <Eigen/Core>

namespace palpate {

// Returns T, monomials of degrees first .. last (in the order of a pack) x polynomials: q(x) = T^T m(x) are orthonormal
// in the mean over the unit ball, or its half z >= 0. Cholesky factorisation of the exact moments.
Eigen::MatrixXd orthonormal_on_ball(int first, int last, bool half);

}  // namespace palpate
