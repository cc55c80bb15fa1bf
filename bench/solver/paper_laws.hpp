// Laws between eqs. (1) and (11) of Zhong et al. 2005, for the study of their difference alone.
//
// With A = J^(-2/3) I, exactly:
//   eq. (1) = eq. (11) + V + C,   V = mu/2 (3 J^(2/3) - 3 - 2 ln J),   C = mu/2 (J^(2/3) - 1)(A - 3)
// V depends only on the volume: V = mu/3 e^2 + 2 mu/27 e^3 + ... in e = ln J, a bulk modulus of 2 mu/3 at
// rest. C couples volume and shear and is of third order: the shear modulus mu J^(2/3) of eq. (1) minus mu of
// eq. (11).
#pragma once

#include <cmath>

#include "offline/material/constitutive_response.hpp"
#include "tests/support/paper_cylinder.hpp"

namespace palpate::test {

// Eq. (1) with 2 ln J scaled by `penalty`: P = P of eq. (1) + (1 - penalty) mu H, H = F^-T. At F = 1 the
// stress is (1 - penalty) mu 1, hence F = 1 is no equilibrium.
inline StressAndTangent with_penalty(double penalty, const Eigen::Matrix3d& F) {
  const Eigen::Matrix3d H = F.inverse().transpose();
  const double excess = (1 - penalty) * kPaperMu;
  StressAndTangent result = stress_and_tangent(CompressibleNeoHookean{kPaperMu, kPaperLambda}, F);
  result.first_piola_kirchhoff += excess * H;
  add_transposed(-excess, H, result.tangent);
  return result;
}

// Eq. (11) + V, with V' = mu (J^(-1/3) - 1/J), V'' = mu (1/J^2 - J^(-4/3) / 3).
inline StressAndTangent with_volume_term(double lambda, const Eigen::Matrix3d& F) {
  const double J = F.determinant();
  const Eigen::Matrix3d H = F.inverse().transpose();
  const double root = std::cbrt(J);
  const double first = kPaperMu * (1 / root - 1 / J);
  const double second = kPaperMu * (1 / (J * J) - 1 / (3 * J * root));
  StressAndTangent result = stress_and_tangent(equation_11(kPaperMu, lambda), F);
  result.first_piola_kirchhoff += first * J * H;
  add_dyad(J * (second * J + first), H, H, result.tangent);
  add_transposed(-first * J, H, result.tangent);
  return result;
}

}  // namespace palpate::test
