// Orthonormal polynomials of three variables over the unit ball. Least squares in these polynomials are well
// conditioned, and a coefficient is the root mean square of its term.
#pragma once

#include <Eigen/Core>

namespace palpate {

// Returns T [monomials x polynomials]: q(x) = T^T m(x) are orthonormal in the mean over the unit ball, or its
// half z >= 0. m: monomials of degrees first .. last, in the order of a pack. Factors the exact moments.
Eigen::MatrixXd orthonormal_on_ball(int first, int last, bool half);

}  // namespace palpate
