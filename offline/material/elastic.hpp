// Hooke's law, for small strain and for large rotations.
//
// LinearElastic, e = (F + F^T)/2 - 1:      W = mu e : e + lambda/2 (tr e)^2,  P = 2 mu e + lambda (tr e) 1
// The stress is linear in the displacement and not invariant under rotation; J has no role.
//
// StVenantKirchhoff, E = (F^T F - 1)/2:    W = mu E : E + lambda/2 (tr E)^2,  S = 2 mu E + lambda (tr E) 1
//   P = F S,   dP[dF] = dF S + F (2 mu dE + lambda (tr dE) 1),   dE = (dF^T F + F^T dF)/2
// StVenantKirchhoff is exact for rigid rotations. The law softens in compression and permits inversion.
#pragma once

#include "offline/material/stress_and_tangent.hpp"

namespace palpate {

inline double strain_energy_density(const LinearElastic& law, const Eigen::Matrix3d& F) {
  const Eigen::Matrix3d e = 0.5 * (F + F.transpose()) - Eigen::Matrix3d::Identity();
  const double trace = e.trace();
  return law.mu * e.squaredNorm() + 0.5 * law.lambda * trace * trace;
}

inline Eigen::Matrix3d first_piola_kirchhoff(const LinearElastic& law, const Eigen::Matrix3d& F) {
  const Eigen::Matrix3d e = 0.5 * (F + F.transpose()) - Eigen::Matrix3d::Identity();
  return 2.0 * law.mu * e + law.lambda * e.trace() * Eigen::Matrix3d::Identity();
}

inline StressAndTangent stress_and_tangent(const LinearElastic& law, const Eigen::Matrix3d& F) {
  StressAndTangent result;
  result.first_piola_kirchhoff = first_piola_kirchhoff(law, F);
  result.tangent.setZero();
  add_identity(law.mu, result.tangent);
  add_transposed(law.mu, Eigen::Matrix3d::Identity(), result.tangent);
  add_dyad(law.lambda, Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity(), result.tangent);
  return result;
}

inline double strain_energy_density(const StVenantKirchhoff& law, const Eigen::Matrix3d& F) {
  const Eigen::Matrix3d E = 0.5 * (F.transpose() * F - Eigen::Matrix3d::Identity());
  const double trace = E.trace();
  return law.mu * E.squaredNorm() + 0.5 * law.lambda * trace * trace;
}

inline Eigen::Matrix3d second_piola_kirchhoff(const StVenantKirchhoff& law, const Eigen::Matrix3d& F) {
  const Eigen::Matrix3d E = 0.5 * (F.transpose() * F - Eigen::Matrix3d::Identity());
  return 2.0 * law.mu * E + law.lambda * E.trace() * Eigen::Matrix3d::Identity();
}

inline Eigen::Matrix3d first_piola_kirchhoff(const StVenantKirchhoff& law, const Eigen::Matrix3d& F) {
  return F * second_piola_kirchhoff(law, F);
}

inline StressAndTangent stress_and_tangent(const StVenantKirchhoff& law, const Eigen::Matrix3d& F) {
  const Eigen::Matrix3d S = second_piola_kirchhoff(law, F);
  const Eigen::Matrix3d left_cauchy_green = F * F.transpose();
  StressAndTangent result;
  result.first_piola_kirchhoff = F * S;
  result.tangent.setZero();
  add_transposed(law.mu, F, result.tangent);  // mu F dF^T F
  add_dyad(law.lambda, F, F, result.tangent);
  for (int J = 0; J < 3; ++J) {  // dF S + mu F F^T dF
    for (int L = 0; L < 3; ++L) result.tangent.block<3, 3>(3 * J, 3 * L).diagonal().array() += S(L, J);
    result.tangent.block<3, 3>(3 * J, 3 * J) += law.mu * left_cauchy_green;
  }
  return result;
}

}  // namespace palpate
