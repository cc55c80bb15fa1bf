// Laws whose energy depends only on I1 = F : F and J = det F: stress and tangent as coefficients of F and
// H = F^-T. Subscripts of W are derivatives, W_1 = dW/dI1, W_J = dW/dJ. As dI1/dF = 2 F and dJ/dF = J H:
//
//   P      = identity F - transposed H
//   dP[dF] = identity dF + transposed H dF^T H + (ff F + fh H)(F : dF) + (fh F + hh H)(H : dF)
//
//   identity = 2 W_1,  transposed = -W_J J,  ff = 4 W_11,  fh = 2 W_1J J,  hh = W_JJ J^2 + W_J J
//
// Between two shape gradients g_a, g_b the tangent is a few products of the vectors F g and H g, instead of a
// contraction of 81 numbers. Energies are per reference volume and need J > 0.
#pragma once

#include <math.h>

namespace palpate {

struct DyadicTangent {
  double identity = 0;
  double transposed = 0;
  double ff = 0;
  double fh = 0;
  double hh = 0;
};

// Zhong et al. 2005, eq. (1):  W = mu/2 (I1 - 3 - 2 ln J) + lambda/2 (J - 1)^2
inline double compressible_neo_hookean_energy(double mu, double lambda, double I1, double J) {
  return 0.5 * mu * (I1 - 3.0 - 2.0 * log(J)) + 0.5 * lambda * (J - 1.0) * (J - 1.0);
}

inline DyadicTangent compressible_neo_hookean_tangent(double mu, double lambda, double J) {
  DyadicTangent terms;
  terms.identity = mu;
  terms.transposed = mu - lambda * J * (J - 1.0);
  terms.hh = lambda * J * (2.0 * J - 1.0);
  return terms;
}

// Abaqus' NEO HOOKE and YEOH:  W = C10 (A - 3) + C20 (A - 3)^2 + C30 (A - 3)^3 + U(J),  A = J^(-2/3) I1,
// U = sum over i of (J - 1)^(2 i) / D_i.
struct YeohLaw {
  double c10;
  double c20;
  double c30;
  double inverse_d[3];
};

inline double yeoh_energy(const YeohLaw& law, double I1, double J) {
  const double t = I1 / cbrt(J * J) - 3.0;
  const double v = (J - 1.0) * (J - 1.0);
  return t * (law.c10 + t * (law.c20 + t * law.c30)) +
         v * (law.inverse_d[0] + v * (law.inverse_d[1] + v * law.inverse_d[2]));
}

inline DyadicTangent yeoh_tangent(const YeohLaw& law, double I1, double J) {
  const double scale = 1.0 / cbrt(J * J);
  const double t = scale * I1 - 3.0;
  const double first = scale * (law.c10 + t * (2.0 * law.c20 + t * 3.0 * law.c30));  // W_1
  const double second = 4.0 * scale * scale * (2.0 * law.c20 + 6.0 * law.c30 * t);   // 4 W_11
  const double v = (J - 1.0) * (J - 1.0);
  const double* d = law.inverse_d;
  const double u1 = (J - 1.0) * (2.0 * d[0] + v * (4.0 * d[1] + v * 6.0 * d[2]));  // U'
  const double u2 = 2.0 * d[0] + v * (12.0 * d[1] + v * 30.0 * d[2]);              // U''
  DyadicTangent terms;
  terms.identity = 2.0 * first;
  terms.transposed = terms.identity * (I1 / 3.0) - u1 * J;  // equals `identity` to the bit at F = 1
  terms.ff = second;
  terms.fh = -4.0 / 3.0 * first - second * I1 / 3.0;
  terms.hh = 4.0 / 9.0 * first * I1 + second * I1 * I1 / 9.0 + J * (u2 * J + u1);
  return terms;
}

}  // namespace palpate
