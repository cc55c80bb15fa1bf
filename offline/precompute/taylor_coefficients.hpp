// The response of the organ at rest to a contact as a power series in its displacement d (asymptotic
// numerical method). The series is exact order by order and needs no nonlinear solve.
//
// Along d = t D r, with the axes D and a fixed direction r, u = a_1 t + a_2 t^2 + ... with a_1 = T D r, T =
// du/dd at rest. With c_j of taylor_orders.hpp, equilibrium of the free dofs requires
//
//   K a_j = -c_j,   a_j = 0 at held dofs,                     j = 2, 3, ...
//
// with the factor at rest. As K is symmetric, the force has the order f_j = T^T c_j. D^T f_j is the gradient
// of order j + 1 of the energy at r.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "offline/fem/static_solver.hpp"

namespace palpate {

inline constexpr int kSeriesDegree = 5;  // degree of the field; the energy has one degree more

// Coefficients of the monomials of y, d = axes y, in the order of a pack.
struct TaylorCoefficients {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  Eigen::MatrixXd field;   // 3 packed nodes x monomials of degree 2 .. kSeriesDegree; length unit
  Eigen::VectorXd energy;  // monomials of degree 3 .. kSeriesDegree + 1; force unit x length unit
};

// Computes the series of a contact that `load` holds at rest. `at_rest`: displacement of all dofs; `tangent`:
// du/dd (num_dofs x 3); `axes`: orthogonal, as long as a mean surface edge. False where the stiffness at rest
// is indefinite, or an element inverts within 0.08 of the axes. Cost: 384 evaluations of P, 96 back-solves.
[[nodiscard]] bool compute_taylor_coefficients(StaticSolver& solver, const LoadCase& load,
                                               const Eigen::VectorXd& at_rest, const Eigen::MatrixXd& tangent,
                                               const std::vector<Eigen::Index>& packed_dofs,
                                               const Eigen::Matrix3d& axes, TaylorCoefficients& series);

}  // namespace palpate
