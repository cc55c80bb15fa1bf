// Ogden's hyperelastic law in the principal stretches, with Abaqus' split into isochoric and volumetric
// parts.
//
// Source: Abaqus Theory Guide, hyperelastic material behaviour, Ogden form:
//   W = sum_i 2 mu_i / alpha_i^2 (q_1^alpha_i + q_2^alpha_i + q_3^alpha_i - 3) + U(J),  q_a = J^(-1/3) l_a
//
// with F = sum_a l_a n_a N_a^T (n, N orthonormal, l_a > 0). Let s_a = q_a^alpha and m their mean. Then
//   w_a  = dW/dl_a = sum_i 2 mu_i / alpha_i (s_a - m) / l_a + U' J / l_a
//   w_ab = d2W/dl_a dl_b = sum_i 2 mu_i [s_a delta_ab - (s_a + s_b)/3 + m/3] / (l_a l_b)
//                          + (U'' J^2 + U' J) / (l_a l_b) - delta_ab w_a / l_a
// (as ds_a/dl_b = alpha s_a (delta_ab - 1/3) / l_b), and for any isotropic law
//   P      = sum_a w_a n_a N_a^T
//   dP[dF] = sum_ab w_ab (n_b . dF N_b) n_a N_a^T
//          + sum_{a<b} k+ (L : dF) L + k- (T : dF) T,   L, T = (n_a N_b^T +- n_b N_a^T) / sqrt 2
//   k+ = (w_a - w_b) / (l_a - l_b),    k- = (w_a + w_b) / (l_a + l_b)
// (the derivative of the polar decomposition; for instance Smith, de Goes, Kim 2019, "Analytic eigensystems
// for isotropic distortion energies"). As l_a -> l_b, k+ -> (w_aa + w_bb)/2 - w_ab, which is taken where the
// quotient would lose more digits than that limit does.
#pragma once

#include <Eigen/Eigenvalues>
#include <cmath>

#include "offline/material/stress_and_tangent.hpp"

namespace palpate {
namespace ogden {

struct PrincipalFrame {
  Eigen::Vector3d stretches;
  Eigen::Matrix3d reference;  // columns N_a
  Eigen::Matrix3d current;    // columns n_a
};

// By F^T F: half the digits of a stretch 1e-8 of the largest are lost, far beyond what an element survives.
inline PrincipalFrame principal_frame(const Eigen::Matrix3d& F) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(F.transpose() * F);
  PrincipalFrame frame;
  frame.reference = eigen.eigenvectors();
  frame.current = F * frame.reference;
  frame.stretches = frame.current.colwise().norm();
  for (int a = 0; a < 3; ++a) frame.current.col(a) /= frame.stretches[a];
  return frame;
}

// s_a and their mean, for one term.
struct Powers {
  Eigen::Vector3d s;
  double mean;
};
inline Powers powers(double alpha, const Eigen::Vector3d& stretches, double J) {
  Powers result;
  const double log_volume = std::log(J) / 3.0;
  for (int a = 0; a < 3; ++a) result.s[a] = std::exp(alpha * (std::log(stretches[a]) - log_volume));
  result.mean = result.s.mean();
  return result;
}

// w_a.
inline Eigen::Vector3d principal_stresses(const Ogden& law, const Eigen::Vector3d& stretches, double J) {
  Eigen::Vector3d w = Eigen::Vector3d::Constant(volumetric_energy(law.volumetric, J).first * J);
  for (const Ogden::Term& term : law.terms) {
    const Powers p = powers(term.alpha, stretches, J);
    w.array() += 2.0 * term.mu / term.alpha * (p.s.array() - p.mean);
  }
  return w.cwiseQuotient(stretches);
}

// w_ab, given w_a.
inline Eigen::Matrix3d principal_tangent(const Ogden& law, const Eigen::Vector3d& stretches, double J,
                                         const Eigen::Vector3d& w) {
  const Derivatives volumetric = volumetric_energy(law.volumetric, J);
  Eigen::Matrix3d result = Eigen::Matrix3d::Constant(J * (volumetric.second * J + volumetric.first));
  for (const Ogden::Term& term : law.terms) {
    const Powers p = powers(term.alpha, stretches, J);
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b)
        result(a, b) += 2.0 * term.mu * ((a == b ? p.s[a] : 0.0) - (p.s[a] + p.s[b] - p.mean) / 3.0);
    }
  }
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) result(a, b) /= stretches[a] * stretches[b];
    result(a, a) -= w[a] / stretches[a];
  }
  return result;
}

}  // namespace ogden

inline double strain_energy_density(const Ogden& law, const Eigen::Matrix3d& F) {
  const double J = F.determinant();
  const Eigen::Vector3d stretches = ogden::principal_frame(F).stretches;
  double energy = volumetric_energy(law.volumetric, J).value;
  for (const Ogden::Term& term : law.terms)
    energy +=
        6.0 * term.mu / (term.alpha * term.alpha) * (ogden::powers(term.alpha, stretches, J).mean - 1.0);
  return energy;
}

inline Eigen::Matrix3d first_piola_kirchhoff(const Ogden& law, const Eigen::Matrix3d& F) {
  const ogden::PrincipalFrame frame = ogden::principal_frame(F);
  const Eigen::Vector3d w = ogden::principal_stresses(law, frame.stretches, F.determinant());
  return frame.current * w.asDiagonal() * frame.reference.transpose();
}

inline StressAndTangent stress_and_tangent(const Ogden& law, const Eigen::Matrix3d& F) {
  // (w_a - w_b) / (l_a - l_b) has a relative error of about 1e-16 / gap, its limit one of gap^2.
  constexpr double kSmallestGap = 1e-5;
  const ogden::PrincipalFrame frame = ogden::principal_frame(F);
  const double J = F.determinant();
  const Eigen::Vector3d& l = frame.stretches;
  const Eigen::Vector3d w = ogden::principal_stresses(law, l, J);
  const Eigen::Matrix3d second = ogden::principal_tangent(law, l, J, w);
  const auto dyad = [&](int a, int b) -> Eigen::Matrix3d {
    return frame.current.col(a) * frame.reference.col(b).transpose();
  };
  StressAndTangent result;
  result.first_piola_kirchhoff = frame.current * w.asDiagonal() * frame.reference.transpose();
  result.tangent.setZero();
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) add_dyad(second(a, b), dyad(a, a), dyad(b, b), result.tangent);
    for (int b = a + 1; b < 3; ++b) {
      const double gap = l[a] - l[b];
      const double symmetric = std::abs(gap) > kSmallestGap * (l[a] + l[b])
                                   ? (w[a] - w[b]) / gap
                                   : 0.5 * (second(a, a) + second(b, b)) - second(a, b);
      const double skew = (w[a] + w[b]) / (l[a] + l[b]);
      const Eigen::Matrix3d ab = dyad(a, b);
      const Eigen::Matrix3d ba = dyad(b, a);
      add_dyad(0.5 * symmetric, ab + ba, ab + ba, result.tangent);
      add_dyad(0.5 * skew, ab - ba, ab - ba, result.tangent);
    }
  }
  return result;
}

}  // namespace palpate
