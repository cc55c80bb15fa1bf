// Ogden's law in the principal stretches with Abaqus' isochoric-volumetric split.
// runtime/kernels/isotropic_law.hpp derives energy and stress.
#pragma once

#include <algorithm>

#include "offline/material/stress_and_tangent.hpp"
#include "runtime/kernels/isotropic_law.hpp"

namespace palpate {

inline OgdenLaw ogden_law(const Ogden& law) {
  OgdenLaw kernel_law = {};
  for (std::size_t i = 0; i < law.terms.size(); ++i) {
    kernel_law.mu[i] = law.terms[i].mu;
    kernel_law.alpha[i] = law.terms[i].alpha;
  }
  std::copy(law.volumetric.inverse_d.begin(), law.volumetric.inverse_d.end(), kernel_law.inverse_d);
  return kernel_law;
}

// MOONEY-RIVLIN in the stretches: alpha = 2 gives the first isochoric invariant, alpha = -2 the second.
inline Ogden as_ogden(const InvariantLaw& mooney_rivlin) {
  return {{{2 * mooney_rivlin.c10, 2}, {2 * mooney_rivlin.c01, -2}}, mooney_rivlin.volumetric};
}

inline PrincipalTangent principal_tangent(const Ogden& law, const Eigen::Matrix3d& F) {
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rows = F;
  double entries[3][3];
  std::copy_n(rows.data(), 9, entries[0]);
  return ogden_tangent(ogden_law(law), entries);
}

inline Eigen::Matrix3d first_piola_kirchhoff(const PrincipalTangent& principal) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(principal.first_piola_kirchhoff[0]);
}

// Returns dP_iJ / dF_kL at (i + 3 J, k + 3 L).
inline Matrix9d full_tangent(const PrincipalTangent& principal) {
  const auto dyad = [&](int p, int q) -> Eigen::Matrix3d {  // n_p N_q^T
    return Eigen::Map<const Eigen::Vector3d>(principal.current[p]) *
           Eigen::Map<const Eigen::RowVector3d>(principal.reference[q]);
  };
  Matrix9d tangent = Matrix9d::Zero();
  for (int p = 0; p < 3; ++p) {
    for (int q = 0; q < 3; ++q) {
      add_dyad(principal.second[p][q], dyad(p, p), dyad(q, q), tangent);
      if (p == q) continue;
      add_dyad(principal.direct[p][q], dyad(p, q), dyad(p, q), tangent);
      add_dyad(principal.crossed[p][q], dyad(p, q), dyad(q, p), tangent);
    }
  }
  return tangent;
}

inline double strain_energy_density(const Ogden& law, const Eigen::Matrix3d& F) {
  return principal_tangent(law, F).energy;
}

inline Eigen::Matrix3d first_piola_kirchhoff(const Ogden& law, const Eigen::Matrix3d& F) {
  return first_piola_kirchhoff(principal_tangent(law, F));
}

inline StressAndTangent stress_and_tangent(const Ogden& law, const Eigen::Matrix3d& F) {
  const PrincipalTangent principal = principal_tangent(law, F);
  return {first_piola_kirchhoff(principal), full_tangent(principal)};
}

}  // namespace palpate
