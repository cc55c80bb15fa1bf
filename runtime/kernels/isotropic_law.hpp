// Isotropic laws that depend on more than I1 and J: energy, stress and tangent in the principal frame.
//
// With F = sum_p l_p n_p N_p^T (n, N orthonormal, l_p > 0), w_p = dW/dl_p, w_pr = d2W/dl_p dl_r:
//
//   P = sum_p w_p n_p N_p^T
//   n_p . dP N_p = sum_r w_pr dF_rr                                       dF_pq = n_p . dF N_q
//   n_p . dP N_q = (k+ + k-)/2 dF_pq + (k+ - k-)/2 dF_qp,  p != q
//   k+ = (w_p - w_q) / (l_p - l_q),   k- = (w_p + w_q) / (l_p + l_q)
//
// Source: Smith, de Goes, Kim 2019, "Analytic eigensystems for isotropic distortion energies". As l_p -> l_q,
// k+ -> (w_pp + w_qq)/2 - w_pq. The code takes this limit where the quotient would lose more digits.
//
// OGDEN, Abaqus Theory Guide:
//
//   W = sum_i 2 mu_i / alpha_i^2 (q_1^alpha_i + q_2^alpha_i + q_3^alpha_i - 3) + U(J),  q_p = J^(-1/3) l_p
//   w_p  = sum_i 2 mu_i / alpha_i (s_p - m) / l_p + U' J / l_p
//   w_pr = [sum_i 2 mu_i (s_p delta_pr - (s_p + s_r - m)/3) + U'' J^2 + U' J] / (l_p l_r) - delta_pr w_p/l_p
//
// with s_p = q_p^alpha_i, m the mean of s_p over p, and ds_p/dl_r = alpha_i s_p (delta_pr - 1/3) / l_r.
//
// MOONEY-RIVLIN has two Ogden terms: mu = 2 C10, alpha = 2 and mu = 2 C01, alpha = -2.
//
// St. Venant-Kirchhoff:  W = mu sum_p E_p^2 + lambda/2 (sum_p E_p)^2,  E_p = (l_p^2 - 1)/2.
//
// Hooke's law at small strain, e = (F + F^T)/2 - 1:  W = mu e : e + lambda/2 (tr e)^2. Its tangent has the
// same form in any frame.
#pragma once

#include <math.h>

namespace palpate {

// U(J) = sum over i of (J - 1)^(2 i) / D_i, and its derivatives.
struct VolumetricResponse {
  double energy;
  double first;
  double second;
};

inline VolumetricResponse volumetric_response(const double inverse_d[3], double J) {
  const double t = J - 1.0;
  const double v = t * t;
  const double* d = inverse_d;
  return {v * (d[0] + v * (d[1] + v * d[2])), t * (2.0 * d[0] + v * (4.0 * d[1] + v * 6.0 * d[2])),
          2.0 * d[0] + v * (12.0 * d[1] + v * 30.0 * d[2])};
}

constexpr int kOgdenTerms = 3;

struct OgdenLaw {
  double mu[kOgdenTerms];     // 0: unused term
  double alpha[kOgdenTerms];  // nonzero in used terms
  double inverse_d[3];
};

// Energy, stress and tangent of a law at one F. Matrices are indexed [i][J].
struct PrincipalTangent {
  double energy;  // per reference volume
  double first_piola_kirchhoff[3][3];
  double current[3][3];    // n_p, a row each
  double reference[3][3];  // N_p
  double second[3][3];     // w_pr
  double direct[3][3];     // (k+ + k-)/2 at [p][q], p != q
  double crossed[3][3];    // (k+ - k-)/2
};

struct PrincipalFrame {
  double stretch[3];       // l_p
  double current[3][3];    // n_p, a row each
  double reference[3][3];  // N_p, a row each
};

// Diagonalises F^T F by Jacobi rotations. A stretch of 1e-8 times the largest stretch loses half its digits.
inline PrincipalFrame principal_frame(const double F[3][3]) {
  constexpr int kMostSweeps = 12;
  constexpr double kNegligible = 1e-33;  // squared off-diagonal entries over the squared trace
  double C[3][3];
  double N[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) C[i][j] = F[0][i] * F[0][j] + F[1][i] * F[1][j] + F[2][i] * F[2][j];
  }
  const double trace = C[0][0] + C[1][1] + C[2][2];
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    const double off = C[0][1] * C[0][1] + C[0][2] * C[0][2] + C[1][2] * C[1][2];
    if (!(off > kNegligible * trace * trace)) break;
    for (int p = 0; p < 2; ++p) {
      for (int q = p + 1; q < 3; ++q) {
        if (C[p][q] == 0) continue;
        const double theta = (C[q][q] - C[p][p]) / (2 * C[p][q]);
        const double t = (theta < 0 ? -1.0 : 1.0) / (fabs(theta) + sqrt(theta * theta + 1));
        const double c = 1 / sqrt(t * t + 1);
        const double s = t * c;
        const auto rotate = [&](double& a, double& b) {
          const double old = a;
          a = c * old - s * b;
          b = s * old + c * b;
        };
        for (int k = 0; k < 3; ++k) rotate(C[k][p], C[k][q]);
        for (int k = 0; k < 3; ++k) rotate(C[p][k], C[q][k]);
        for (int k = 0; k < 3; ++k) rotate(N[p][k], N[q][k]);
      }
    }
  }
  PrincipalFrame frame;
  for (int p = 0; p < 3; ++p) {
    double squares = 0;
    for (int i = 0; i < 3; ++i) {
      frame.reference[p][i] = N[p][i];
      frame.current[p][i] = F[i][0] * N[p][0] + F[i][1] * N[p][1] + F[i][2] * N[p][2];
      squares += frame.current[p][i] * frame.current[p][i];
    }
    frame.stretch[p] = sqrt(squares);
    for (int i = 0; i < 3; ++i) frame.current[p][i] /= frame.stretch[p];
  }
  return frame;
}

// Computes the stress from w_p, and the tangent from w_p and from w_pr in `tangent.second`.
inline void complete_tangent(const PrincipalFrame& frame, const double w[3], PrincipalTangent& tangent) {
  // (w_p - w_q) / (l_p - l_q) has a relative error of about 1e-16 / gap, and its limit an error of gap^2.
  constexpr double kSmallestGap = 1e-5;
  const double* l = frame.stretch;
  for (int p = 0; p < 3; ++p) {
    for (int i = 0; i < 3; ++i) {
      tangent.current[p][i] = frame.current[p][i];
      tangent.reference[p][i] = frame.reference[p][i];
      double sum = 0;
      for (int r = 0; r < 3; ++r) sum += frame.current[r][p] * w[r] * frame.reference[r][i];
      tangent.first_piola_kirchhoff[p][i] = sum;
    }
    tangent.direct[p][p] = tangent.crossed[p][p] = 0;
    for (int q = 0; q < p; ++q) {
      const double gap = l[p] - l[q];
      const double symmetric =
          fabs(gap) > kSmallestGap * (l[p] + l[q])
              ? (w[p] - w[q]) / gap
              : 0.5 * (tangent.second[p][p] + tangent.second[q][q]) - tangent.second[p][q];
      const double skew = (w[p] + w[q]) / (l[p] + l[q]);
      tangent.direct[p][q] = tangent.direct[q][p] = 0.5 * (symmetric + skew);
      tangent.crossed[p][q] = tangent.crossed[q][p] = 0.5 * (symmetric - skew);
    }
  }
}

inline PrincipalTangent ogden_tangent(const OgdenLaw& law, const double F[3][3]) {
  const PrincipalFrame frame = principal_frame(F);
  const double* l = frame.stretch;
  const double J = F[0][0] * (F[1][1] * F[2][2] - F[1][2] * F[2][1]) +
                   F[0][1] * (F[1][2] * F[2][0] - F[1][0] * F[2][2]) +
                   F[0][2] * (F[1][0] * F[2][1] - F[1][1] * F[2][0]);
  const VolumetricResponse volumetric = volumetric_response(law.inverse_d, J);
  PrincipalTangent tangent;
  tangent.energy = volumetric.energy;
  double w[3];  // until the sums are complete: w_p l_p, and w_pr l_p l_r + delta_pr w_p l_p in `second`
  for (int p = 0; p < 3; ++p) {
    w[p] = volumetric.first * J;
    for (int r = 0; r < 3; ++r) tangent.second[p][r] = J * (volumetric.second * J + volumetric.first);
  }
  const double log_volume = log(J) / 3.0;
  for (int i = 0; i < kOgdenTerms; ++i) {
    if (law.mu[i] == 0) continue;
    const double alpha = law.alpha[i];
    double s[3];
    for (int p = 0; p < 3; ++p) s[p] = exp(alpha * (log(l[p]) - log_volume));
    const double mean = (s[0] + s[1] + s[2]) / 3.0;
    tangent.energy += 6.0 * law.mu[i] / (alpha * alpha) * (mean - 1.0);
    for (int p = 0; p < 3; ++p) {
      w[p] += 2.0 * law.mu[i] / alpha * (s[p] - mean);
      for (int r = 0; r < 3; ++r)
        tangent.second[p][r] += 2.0 * law.mu[i] * ((p == r ? s[p] : 0.0) - (s[p] + s[r] - mean) / 3.0);
    }
  }
  for (int p = 0; p < 3; ++p) {
    w[p] /= l[p];
    for (int r = 0; r < 3; ++r) tangent.second[p][r] /= l[p] * l[r];
    tangent.second[p][p] -= w[p] / l[p];
  }
  complete_tangent(frame, w, tangent);
  return tangent;
}

inline PrincipalTangent st_venant_kirchhoff_tangent(double mu, double lambda, const double F[3][3]) {
  const PrincipalFrame frame = principal_frame(F);
  const double* l = frame.stretch;
  double E[3];
  for (int p = 0; p < 3; ++p) E[p] = 0.5 * (l[p] * l[p] - 1.0);
  const double trace = E[0] + E[1] + E[2];
  PrincipalTangent tangent;
  tangent.energy = mu * (E[0] * E[0] + E[1] * E[1] + E[2] * E[2]) + 0.5 * lambda * trace * trace;
  double w[3];
  for (int p = 0; p < 3; ++p) {
    const double stress = 2.0 * mu * E[p] + lambda * trace;
    w[p] = l[p] * stress;
    for (int r = 0; r < 3; ++r) tangent.second[p][r] = lambda * l[p] * l[r];
    tangent.second[p][p] += stress + 2.0 * mu * l[p] * l[p];
  }
  complete_tangent(frame, w, tangent);
  return tangent;
}

inline PrincipalTangent linear_elastic_tangent(double mu, double lambda, const double F[3][3]) {
  PrincipalTangent tangent = {};
  const double trace = F[0][0] + F[1][1] + F[2][2] - 3.0;
  tangent.energy = 0.5 * lambda * trace * trace;
  for (int p = 0; p < 3; ++p) {
    tangent.current[p][p] = tangent.reference[p][p] = 1;
    for (int q = 0; q < 3; ++q) {
      const double e = 0.5 * (F[p][q] + F[q][p]) - (p == q ? 1.0 : 0.0);
      tangent.energy += mu * e * e;
      tangent.first_piola_kirchhoff[p][q] = 2.0 * mu * e + (p == q ? lambda * trace : 0.0);
      tangent.second[p][q] = lambda + (p == q ? 2.0 * mu : 0.0);
      tangent.direct[p][q] = tangent.crossed[p][q] = p == q ? 0.0 : mu;
    }
  }
  return tangent;
}

}  // namespace palpate
