// Generalised minimal residuals (GMRES) for A x = b with an unsymmetric A, preconditioned from the right.
//
// Source: Saad and Schultz 1986. No restarts: each iteration stores two vectors.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "offline/numerics/decompositions.hpp"

namespace palpate {

// `apply(v)` returns A v. `precondition(v)` replaces v by about A^-1 v and returns success. Returns true and
// sets x once |b - A x| <= tolerance |b|; each of at most `max_sweeps` sweeps adds a basis vector.
template <typename Apply, typename Precondition>
[[nodiscard]] bool gmres(const Apply& apply, const Precondition& precondition, const Eigen::VectorXd& b,
                         double tolerance, int max_sweeps, Eigen::VectorXd& x) {
  const double norm = b.norm();
  if (!(norm > 0)) return false;
  std::vector<Eigen::VectorXd> basis = {b / norm};
  std::vector<Eigen::VectorXd> preconditioned;
  Eigen::MatrixXd hessenberg = Eigen::MatrixXd::Zero(max_sweeps + 1, max_sweeps);
  for (int sweep = 0; sweep < max_sweeps; ++sweep) {
    preconditioned.push_back(basis.back());
    if (!precondition(preconditioned.back())) return false;
    Eigen::VectorXd next = apply(preconditioned.back());
    const double length_before = next.norm();
    for (int i = 0; i <= sweep; ++i) {
      hessenberg(i, sweep) = next.dot(basis[static_cast<size_t>(i)]);
      next -= hessenberg(i, sweep) * basis[static_cast<size_t>(i)];
    }
    const double length = next.norm();
    hessenberg(sweep + 1, sweep) = length;
    const auto system = hessenberg.topLeftCorner(sweep + 2, sweep + 1);
    const Eigen::VectorXd target = norm * Eigen::VectorXd::Unit(sweep + 2, 0);
    const Eigen::VectorXd weights = least_squares(system, target);
    if ((target - system * weights).norm() <= tolerance * norm) {
      x.setZero(b.size());
      for (int i = 0; i <= sweep; ++i) x += weights[i] * preconditioned[static_cast<size_t>(i)];
      return x.allFinite();
    }
    if (!(length > 1e-14 * length_before)) return false;  // rounding: the basis cannot grow
    basis.push_back(next / length);
  }
  return false;
}

}  // namespace palpate
