// Stress and tangent of laws in I1 and J alone, from their coefficients of F and H = F^-T.
#pragma once

#include "offline/material/stress_and_tangent.hpp"
#include "runtime/kernels/dyadic_tangent.hpp"

namespace palpate {

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
