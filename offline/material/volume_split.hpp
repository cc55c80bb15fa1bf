// Splits a law, W(F) = W'(F) + U(theta). U is the nearly incompressible part, theta(F) its measure of volume.
//
//                                        W'                       U                            theta
//   COMPRESSIBLE NEO HOOKE               that of lambda = 0       lambda/2 (theta - 1)^2       J
//   NEO HOOKE, MOONEY-RIVLIN, YEOH,
//   OGDEN                                the isochoric part       sum (theta - 1)^(2i) / D_i   J
//   Hooke's law, e and E of elastic.hpp  that of lambda = 0       lambda/2 (theta - 1)^2       1 + tr e
//   St. Venant-Kirchhoff                 that of lambda = 0       lambda/2 (theta - 1)^2       1 + tr E
//
//   dJ = J H : dF, d2J[dF] = J ((H : dF) H - H dF^T H);  d tr e = 1 : dF;  d tr E = F : dF, d2 tr E[dF] = dF
#pragma once

#include "offline/material/constitutive_response.hpp"

namespace palpate {

// Returns W' as a law.
inline Law without_volume_term(const Law& law) {
  Law rest = law;
  std::visit(
      [](auto& concrete) {
        if constexpr (requires { concrete.volumetric; }) {
          concrete.volumetric = {};
        } else {
          concrete.lambda = 0;
        }
      },
      rest);
  return rest;
}

// U and its derivatives by theta.
struct VolumeTerm {
  double energy = 0;
  double pressure = 0;   // U', the mean stress; positive in tension
  double stiffness = 0;  // U''
};

// Returns U and its derivatives. Abaqus' laws: U = a v + b v^2 + c v^3, v = (theta - 1)^2, a, b, c = 1 / D_i.
inline VolumeTerm volume_term(const Law& law, double theta) {
  const double change = theta - 1;
  const double v = change * change;
  return std::visit(
      [&](const auto& concrete) -> VolumeTerm {
        if constexpr (requires { concrete.volumetric; }) {
          const auto& [a, b, c] = concrete.volumetric.inverse_d;
          return {v * (a + v * (b + v * c)), change * (2 * a + v * (4 * b + v * 6 * c)),
                  2 * a + v * (12 * b + v * 30 * c)};
        } else {
          return {0.5 * concrete.lambda * v, concrete.lambda * change, concrete.lambda};
        }
      },
      law);
}

inline double volume_measure(const Law& law, const Eigen::Matrix3d& F) {  // theta
  if (std::holds_alternative<LinearElastic>(law)) return F.trace() - 2;
  if (std::holds_alternative<StVenantKirchhoff>(law)) return 0.5 * (F.squaredNorm() - 1);
  return F.determinant();
}

// Returns dtheta/dF.
inline Eigen::Matrix3d volume_gradient(const Law& law, const Eigen::Matrix3d& F) {
  if (std::holds_alternative<LinearElastic>(law)) return Eigen::Matrix3d::Identity();
  if (std::holds_alternative<StVenantKirchhoff>(law)) return F;
  return F.determinant() * F.inverse().transpose();
}

// Adds scale d2theta to the tangent.
inline void add_volume_curvature(const Law& law, double scale, const Eigen::Matrix3d& F, Matrix9d& tangent) {
  if (std::holds_alternative<LinearElastic>(law)) return;
  if (std::holds_alternative<StVenantKirchhoff>(law)) return add_identity(scale, tangent);
  const double J = F.determinant();
  const Eigen::Matrix3d H = F.inverse().transpose();
  add_dyad(scale * J, H, H, tangent);
  add_transposed(-scale * J, H, tangent);
}

// Adds scale dJ/dF to the stress and scale d2J to the tangent, as coefficients of F and H.
inline void add_volume_terms(double scale, double J, DyadicTangent& terms) {
  terms.transposed -= scale * J;
  terms.hh += scale * J;
}

}  // namespace palpate
