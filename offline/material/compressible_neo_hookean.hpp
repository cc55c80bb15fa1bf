// Compressible neo-Hookean solid: stored energy, first Piola-Kirchhoff stress, consistent tangent.
//
// Source: Zhong, Wachowiak, Peters 2005, eq. (1):  W = mu/2 (I - 3 - 2 ln J) + lambda/2 (J - 1)^2,
// I = F : F, J = det F. With dJ/dF = J F^-T and dI/dF = 2 F:
//
//   P = dW/dF = mu (F - F^-T) + lambda J (J - 1) F^-T
//   dP[dF]    = mu dF + (mu - lambda J (J - 1)) F^-T dF^T F^-T + lambda J (2 J - 1) (F^-T : dF) F^-T
//
// Cauchy stress P F^T / J = mu/J (g - 1) + lambda (J - 1) 1 is their eq. (2). At F = 1 the tangent is Hooke's
// law with Lame parameters mu and lambda. P itself stays finite for J < 0 (only W holds ln J), so whoever
// iterates must refuse J <= 0; these functions require J > 0.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>

#include "offline/mesh/model.hpp"

namespace palpate {

using Matrix9d = Eigen::Matrix<double, 9, 9>;

// What a law answers at one deformation gradient. Stresses in force unit / length unit^2.
struct StressAndTangent {
  Eigen::Matrix3d first_piola_kirchhoff;
  Matrix9d tangent;  // dP_iJ / dF_kL at (i + 3 J, k + 3 L)
};

// W, per reference volume.
inline double strain_energy_density(const CompressibleNeoHookean& law,
                                    const Eigen::Matrix3d& deformation_gradient) {
  const double J = deformation_gradient.determinant();
  return 0.5 * law.mu * (deformation_gradient.squaredNorm() - 3.0 - 2.0 * std::log(J)) +
         0.5 * law.lambda * (J - 1.0) * (J - 1.0);
}

inline Eigen::Matrix3d first_piola_kirchhoff(const CompressibleNeoHookean& law,
                                             const Eigen::Matrix3d& deformation_gradient) {
  const double J = deformation_gradient.determinant();
  const Eigen::Matrix3d inverse_transpose = deformation_gradient.inverse().transpose();
  return law.mu * (deformation_gradient - inverse_transpose) + law.lambda * J * (J - 1.0) * inverse_transpose;
}

inline StressAndTangent stress_and_tangent(const CompressibleNeoHookean& law,
                                           const Eigen::Matrix3d& deformation_gradient) {
  const double J = deformation_gradient.determinant();
  const Eigen::Matrix3d H = deformation_gradient.inverse().transpose();  // F^-T
  const double transposed = law.mu - law.lambda * J * (J - 1.0);
  const double volumetric = law.lambda * J * (2.0 * J - 1.0);
  StressAndTangent result;
  result.first_piola_kirchhoff = law.mu * deformation_gradient - transposed * H;
  // (F^-T dF^T F^-T)_iJ = H_iL dF_kL H_kJ
  for (int L = 0; L < 3; ++L) {
    for (int k = 0; k < 3; ++k) {
      for (int j = 0; j < 3; ++j) {
        for (int i = 0; i < 3; ++i) {
          result.tangent(i + 3 * j, k + 3 * L) =
              transposed * H(i, L) * H(k, j) + volumetric * H(i, j) * H(k, L);
        }
      }
      result.tangent(k + 3 * L, k + 3 * L) += law.mu;
    }
  }
  return result;
}

}  // namespace palpate
