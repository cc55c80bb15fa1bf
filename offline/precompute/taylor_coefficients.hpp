// How the organ at rest answers a contact: a power series in its displacement d, exact order by order, without a
// solve.
//
// Along d = t D r, D a scale and r fixed, the displacement from rest is a_1 t + a_2 t^2 + ... with a_1 = T D r, T the
// exact tangent du/dd at rest, and nothing moves where it is held. With c_j of path_orders.hpp, equilibrium of the
// free dofs asks for
//
//   K a_j = -c_j,   a_j = 0 where the dofs are held,                     j = 2, 3, ...
//
// all with the factor at rest. The tool's force is of order j  f_j = T^T c_j, for K is symmetric, and the order j + 1
// of the energy has D f_j as its gradient.
//
// On the brain, pushed by one edge length, nu = 0.4, it leaves 0.32 % (p95) to third order, 0.11 to fourth, 0.03 to
// fifth.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "offline/fem/static_solver.hpp"

namespace palpate {

inline constexpr int kSeriesDegree = 5;  // of the field; of the energy one more

// In y, d = axes y. Monomials in the order of a pack.
struct TaylorCoefficients {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  Eigen::MatrixXd field;   // 3 packed nodes x monomials of degree 2 .. kSeriesDegree; length unit
  Eigen::VectorXd energy;  // monomials of degree 3 .. kSeriesDegree + 1; force unit x length unit
};

// Of a contact that is held at rest by `load`, where the displacement of all dofs is `at_rest` and du/dd is `tangent`
// (num_dofs x 3). `axes`: orthogonal, of the length of a mean surface edge, which the differences are scaled by.
// False where the stiffness at rest is not positive definite, or an element inverts within 0.08 of those axes. Cost:
// 384 evaluations of P, 96 back-solves, each refined.
[[nodiscard]] bool compute_taylor_coefficients(StaticSolver& solver, const LoadCase& load,
                                               const Eigen::VectorXd& at_rest, const Eigen::MatrixXd& tangent,
                                               const std::vector<Eigen::Index>& packed_dofs,
                                               const Eigen::Matrix3d& axes, TaylorCoefficients& series);

}  // namespace palpate
