// Hyperelastic laws in the invariants of the isochoric deformation: Abaqus' NEO HOOKE, MOONEY-RIVLIN, YEOH.
//
// Source: Abaqus Theory Guide, hyperelastic material behaviour; NEO HOOKE is Zhong et al. 2005 eq. (11).
//
//   W = C10 (A - 3) + C01 (B - 3) + C20 (A - 3)^2 + C30 (A - 3)^3 + U(J)
//   A = J^(-2/3) I1,  I1 = F : F;      B = J^(-4/3) I2,  I2 = (I1^2 - |F^T F|^2) / 2
//
// With G1 = dI1/dF = 2 F and G2 = dI2/dF = 2 (I1 F - F F^T F):
//   dA/dF = J^(-2/3) (G1 - 2/3 I1 H)                dB/dF = J^(-4/3) (G2 - 4/3 I2 H)
// and, with p = 2/3 for A and 4/3 for B, and (G, I) of I1 or I2,
//   d(dA/dF)[dF] = J^-p (dG[dF] - p (G : dF) H - p (H : dF) G + p^2 I (H : dF) H + p I H dF^T H)
//   dG1[dF] = 2 dF,   dG2[dF] = 2 ((G1 : dF) F + I1 dF - dF F^T F - F dF^T F - F F^T dF)
//
//   P      = W_A dA/dF + C01 dB/dF + U' J H,   W_A = C10 + 2 C20 (A - 3) + 3 C30 (A - 3)^2
//   dP[dF] = W_A d(dA/dF) + W_AA (dA/dF : dF) dA/dF + C01 d(dB/dF)
//            + (U'' J^2 + U' J)(H : dF) H - U' J H dF^T H
#pragma once

#include <cmath>

#include "offline/material/dyadic_tangent.hpp"

namespace palpate {
namespace invariant_law {

struct Kinematics {
  double J;
  double volume_scale;                 // J^(-2/3)
  Eigen::Matrix3d H;                   // F^-T
  Eigen::Matrix3d right_cauchy_green;  // F^T F
  double i1;
  double i2;
  explicit Kinematics(const Eigen::Matrix3d& F)
      : J(F.determinant()),
        volume_scale(1.0 / std::cbrt(J * J)),
        H(F.inverse().transpose()),
        right_cauchy_green(F.transpose() * F),
        i1(right_cauchy_green.trace()),
        i2(0.5 * (i1 * i1 - right_cauchy_green.squaredNorm())) {}
};

inline Eigen::Matrix3d gradient_of_i2(const Kinematics& k, const Eigen::Matrix3d& F) {
  return 2.0 * (k.i1 * F - F * k.right_cauchy_green);
}

// Adds scale (-p (G : dF) H - p (H : dF) G + p^2 I (H : dF) H + p I H dF^T H).
inline void add_volume_terms(double scale, double p, double I, const Eigen::Matrix3d& G,
                             const Eigen::Matrix3d& H, Matrix9d& tangent) {
  add_dyad(-scale * p, H, G, tangent);
  add_dyad(-scale * p, G, H, tangent);
  add_dyad(scale * p * p * I, H, H, tangent);
  add_transposed(scale * p * I, H, tangent);
}

// Adds scale * 2 (I1 dF + (G1 : dF) F - dF F^T F - F dF^T F - F F^T dF).
inline void add_curvature_of_i2(double scale, const Kinematics& k, const Eigen::Matrix3d& F,
                                Matrix9d& tangent) {
  add_identity(2.0 * scale * k.i1, tangent);
  add_dyad(4.0 * scale, F, F, tangent);
  const Eigen::Matrix3d left_cauchy_green = F * F.transpose();
  for (int L = 0; L < 3; ++L) {
    for (int kk = 0; kk < 3; ++kk) {
      for (int J = 0; J < 3; ++J) {
        for (int i = 0; i < 3; ++i) {
          const double right = i == kk ? k.right_cauchy_green(L, J) : 0.0;
          const double left = J == L ? left_cauchy_green(i, kk) : 0.0;
          tangent(i + 3 * J, kk + 3 * L) -= 2.0 * scale * (right + left + F(i, L) * F(kk, J));
        }
      }
    }
  }
}

}  // namespace invariant_law

// Returns the law without its term of C01.
inline YeohLaw yeoh_part(const InvariantLaw& law) {
  const auto& [d1, d2, d3] = law.volumetric.inverse_d;
  return {law.c10, law.c20, law.c30, {d1, d2, d3}};
}

inline double strain_energy_density(const InvariantLaw& law, const Eigen::Matrix3d& F) {
  const invariant_law::Kinematics k(F);
  return yeoh_energy(yeoh_part(law), k.i1, k.J) + law.c01 * (k.volume_scale * k.volume_scale * k.i2 - 3.0);
}

inline DyadicTangent dyadic_tangent(const InvariantLaw& law, double I1, double J) {
  return yeoh_tangent(yeoh_part(law), I1, J);
}

inline Eigen::Matrix3d first_piola_kirchhoff(const InvariantLaw& law, const Eigen::Matrix3d& F) {
  const invariant_law::Kinematics k(F);
  const DyadicTangent terms = dyadic_tangent(law, k.i1, k.J);
  Eigen::Matrix3d P = terms.identity * F - terms.transposed * k.H;
  if (law.c01 != 0.0) {
    P += (law.c01 * k.volume_scale * k.volume_scale) *
         (invariant_law::gradient_of_i2(k, F) - 4.0 / 3.0 * k.i2 * k.H);
  }
  return P;
}

inline StressAndTangent stress_and_tangent(const InvariantLaw& law, const Eigen::Matrix3d& F) {
  const invariant_law::Kinematics k(F);
  StressAndTangent result = full_response(dyadic_tangent(law, k.i1, k.J), F, k.H);
  if (law.c01 != 0.0) {
    const double scale = law.c01 * k.volume_scale * k.volume_scale;
    const Eigen::Matrix3d gradient = invariant_law::gradient_of_i2(k, F);
    result.first_piola_kirchhoff += scale * (gradient - 4.0 / 3.0 * k.i2 * k.H);
    invariant_law::add_curvature_of_i2(scale, k, F, result.tangent);
    invariant_law::add_volume_terms(scale, 4.0 / 3.0, k.i2, gradient, k.H, result.tangent);
  }
  return result;
}

}  // namespace palpate
