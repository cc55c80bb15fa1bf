// Reference: every constitutive law as principal stresses of principal stretches. These formulas share no
// code with offline/material, so they check the solver's homogeneous states.
//
// F = sum_a l_a n_a N_a^T and W(l_1, l_2, l_3) give P = sum_a P_a n_a N_a^T with P_a = dW/dl_a (Ogden 1984,
// section 4.3). With J = l_1 l_2 l_3 and q_a = J^(-1/3) l_a:
//   eq. (1) of Zhong et al. 2005:  P_a = mu (l_a - 1/l_a) + lambda (J - 1) J / l_a
//   isochoric w(q) + U(J):         l_a P_a = q_a w_a - (sum_b q_b w_b) / 3 + J U',   w_a = dw/dq_a
//     polynomial:  w = C10 (A-3) + C20 (A-3)^2 + C30 (A-3)^3 + C01 (B-3),  A = sum q_a^2,  B = sum q_a^-2
//     Ogden:       w = sum_i 2 mu_i / alpha_i^2 (sum_a q_a^alpha_i - 3)
//   St. Venant-Kirchhoff:          P_a = l_a (2 mu E_a + lambda sum E),   E_a = (l_a^2 - 1) / 2
//   small strain:                  P_a = 2 mu e_a + lambda sum e,         e_a = l_a - 1, where no axis turns
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "offline/material/law.hpp"

namespace palpate::test {

struct PrincipalStretchLaw {
  std::string name;  // letters and digits
  Law law;
  std::function<Eigen::Vector3d(const Eigen::Vector3d& stretches)> stresses;
};

inline PrincipalStretchLaw principal_compressible_neo_hookean(double mu, double lambda) {
  return {"CompressibleNeoHookean", CompressibleNeoHookean{mu, lambda}, [=](const Eigen::Vector3d& l) {
            const double J = l.prod();
            return Eigen::Vector3d(mu * (l - l.cwiseInverse()) + lambda * (J - 1) * J * l.cwiseInverse());
          }};
}

// P_a from the isochoric l_a P_a before the subtraction of the mean.
inline Eigen::Vector3d with_pressure(const VolumetricEnergy& volumetric, const Eigen::Vector3d& l,
                                     const Eigen::Vector3d& isochoric) {
  const double J = l.prod();
  double slope = 0;  // U'
  for (std::size_t i = 0; i < 3; ++i) {
    const double power = 2.0 * static_cast<double>(i + 1);
    slope += power * volumetric.inverse_d[i] * std::pow(J - 1, power - 1);
  }
  return ((isochoric.array() - isochoric.mean() + J * slope) / l.array()).matrix();
}

inline PrincipalStretchLaw principal_polynomial(std::string name, const InvariantLaw& law) {
  return {std::move(name), law, [=](const Eigen::Vector3d& l) {
            const Eigen::Array3d squares = l.array().square() / std::pow(l.prod(), 2.0 / 3.0);
            const double t = squares.sum() - 3;
            const double slope = law.c10 + 2 * law.c20 * t + 3 * law.c30 * t * t;
            return with_pressure(law.volumetric, l, 2 * slope * squares - 2 * law.c01 * squares.inverse());
          }};
}

inline PrincipalStretchLaw principal_ogden(std::string name, const Ogden& law) {
  return {std::move(name), law, [=](const Eigen::Vector3d& l) {
            Eigen::Array3d isochoric = Eigen::Array3d::Zero();
            for (const Ogden::Term& term : law.terms)
              isochoric += 2 * term.mu / term.alpha * (l / std::cbrt(l.prod())).array().pow(term.alpha);
            return with_pressure(law.volumetric, l, isochoric);
          }};
}

inline PrincipalStretchLaw principal_st_venant_kirchhoff(double mu, double lambda) {
  return {"StVenantKirchhoff", StVenantKirchhoff{mu, lambda}, [=](const Eigen::Vector3d& l) {
            const Eigen::Array3d strain = 0.5 * (l.array().square() - 1);
            return Eigen::Vector3d(l.array() * (2 * mu * strain + lambda * strain.sum()));
          }};
}

inline PrincipalStretchLaw principal_linear_elastic(double mu, double lambda) {
  return {"LinearElastic", LinearElastic{mu, lambda}, [=](const Eigen::Vector3d& l) {
            const Eigen::Array3d strain = l.array() - 1;
            return Eigen::Vector3d(2 * mu * strain + lambda * strain.sum());
          }};
}

// One of each law, with every term nonzero.
inline std::vector<PrincipalStretchLaw> principal_stretch_laws() {
  InvariantLaw neo_hooke;
  neo_hooke.c10 = 0.5;
  neo_hooke.volumetric.inverse_d = {2, 0, 0};
  InvariantLaw mooney_rivlin = neo_hooke;
  mooney_rivlin.c10 = 0.3;
  mooney_rivlin.c01 = 0.2;
  InvariantLaw yeoh;
  yeoh.c10 = 0.5;
  yeoh.c20 = -0.05;
  yeoh.c30 = 0.02;
  yeoh.volumetric.inverse_d = {2, 0.4, 0.1};
  Ogden ogden;
  ogden.terms = {{0.5, 1.3}, {0.1, 5.0}, {0.3, -2.0}};
  ogden.volumetric.inverse_d = {1, 0.2, 0.1};
  return {principal_compressible_neo_hookean(1, 4),
          principal_polynomial("NeoHooke", neo_hooke),
          principal_polynomial("MooneyRivlin", mooney_rivlin),
          principal_polynomial("Yeoh", yeoh),
          principal_ogden("OgdenN3", ogden),
          principal_st_venant_kirchhoff(1, 2),
          principal_linear_elastic(1, 2)};
}

}  // namespace palpate::test
