// Compressible neo-Hookean solid.
//
// Source: Zhong, Wachowiak, Peters 2005, eq. (1):  W = mu/2 (I - 3 - 2 ln J) + lambda/2 (J - 1)^2, I = F : F.
//
//   P     = mu (F - H) + lambda J (J - 1) H
//   dP[dF] = mu dF + (mu - lambda J (J - 1)) H dF^T H + lambda J (2 J - 1) (H : dF) H
//
// Cauchy stress P F^T / J = mu/J (g - 1) + lambda (J - 1) 1 is eq. (2). At F = 1 the tangent is Hooke's law
// with Lame parameters mu and lambda. These functions require J > 0: P stays finite for J < 0, so a solver
// must refuse such states itself. DyadicTangent holds the coefficients of P and dP.
#pragma once

#include "offline/material/dyadic_tangent.hpp"

namespace palpate {

// Returns W per reference volume.
inline double strain_energy_density(const CompressibleNeoHookean& law, const Eigen::Matrix3d& F) {
  return compressible_neo_hookean_energy(law.mu, law.lambda, F.squaredNorm(), F.determinant());
}

inline DyadicTangent dyadic_tangent(const CompressibleNeoHookean& law, double /*I1*/, double J) {
  return compressible_neo_hookean_tangent(law.mu, law.lambda, J);
}

inline Eigen::Matrix3d first_piola_kirchhoff(const CompressibleNeoHookean& law, const Eigen::Matrix3d& F) {
  const DyadicTangent terms = dyadic_tangent(law, F.squaredNorm(), F.determinant());
  return terms.identity * F - terms.transposed * F.inverse().transpose();
}

inline StressAndTangent stress_and_tangent(const CompressibleNeoHookean& law, const Eigen::Matrix3d& F) {
  return full_response(dyadic_tangent(law, F.squaredNorm(), F.determinant()), F, F.inverse().transpose());
}

}  // namespace palpate
