// Polynomials of three variables that are orthonormal over the unit ball, in which least squares keep their
// digits and the size of a coefficient is what it means for the function.
#pragma once

#include <Eigen/Core>

namespace palpate {

// T, monomials of degrees first .. last (in the order of a pack) x as many: q(x) = T^T m(x) are orthonormal in the
// mean over the unit ball, or over its half z >= 0. From the exact moments of the monomials, by Cholesky.
Eigen::MatrixXd orthonormal_on_ball(int first, int last, bool half);

}  // namespace palpate
