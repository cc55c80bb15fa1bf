// Stress and tangent of a law whose energy depends on I1 = F : F and J alone, as coefficients of F and H =
// F^-T. With W_1 = dW/dI1, W_J = dW/dJ and so on, as dI1/dF = 2 F and dJ/dF = J H:
//
//   P      = identity F - transposed H
//   dP[dF] = identity dF + transposed H dF^T H + (ff F + fh H)(F : dF) + (fh F + hh H)(H : dF)
//
//   identity = 2 W_1,  transposed = -W_J J,  ff = 4 W_11,  fh = 2 W_1J J,  hh = W_JJ J^2 + W_J J
//
// Between two shape gradients g_a, g_b the tangent is a few products of the vectors F g and H g, where the
// full one costs a contraction of 81 numbers.
#pragma once

#include "offline/material/stress_and_tangent.hpp"

namespace palpate {

struct DyadicTangent {
  double identity = 0;
  double transposed = 0;
  double ff = 0;
  double fh = 0;
  double hh = 0;
};

inline StressAndTangent full_response(const DyadicTangent& terms, const Eigen::Matrix3d& F,
                                      const Eigen::Matrix3d& H) {
  StressAndTangent result = {terms.identity * F - terms.transposed * H, Matrix9d::Zero()};
  add_identity(terms.identity, result.tangent);
  add_transposed(terms.transposed, H, result.tangent);
  add_dyad(1.0, terms.fh * F + terms.hh * H, H, result.tangent);
  add_dyad(1.0, terms.ff * F + terms.fh * H, F, result.tangent);
  return result;
}

}  // namespace palpate
