// Stress and tangent at one deformation gradient, and the terms that several laws share.
//
// Notation: F the deformation gradient, J = det F, H = F^-T. dJ/dF = J H and dH[dF] = -H dF^T H.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

#include "offline/material/law.hpp"

namespace palpate {

using Matrix9d = Eigen::Matrix<double, 9, 9>;

// Stresses in force unit / length unit^2.
struct StressAndTangent {
  Eigen::Matrix3d first_piola_kirchhoff;
  Matrix9d tangent;  // dP_iJ / dF_kL at (i + 3 J, k + 3 L)
};

// Adds dP = scale a (b : dF).
inline void add_dyad(double scale, const Eigen::Matrix3d& a, const Eigen::Matrix3d& b, Matrix9d& tangent) {
  tangent.noalias() += (scale * a.reshaped()) * b.reshaped().transpose();
}

// Adds dP = scale dF.
inline void add_identity(double scale, Matrix9d& tangent) {
  tangent.diagonal().array() += scale;
}

// Adds dP = scale H dF^T H, where (H dF^T H)_iJ = H_iL dF_kL H_kJ.
inline void add_transposed(double scale, const Eigen::Matrix3d& H, Matrix9d& tangent) {
  for (int L = 0; L < 3; ++L) {
    for (int k = 0; k < 3; ++k) {
      for (int J = 0; J < 3; ++J) {
        for (int i = 0; i < 3; ++i) tangent(i + 3 * J, k + 3 * L) += scale * H(i, L) * H(k, J);
      }
    }
  }
}

}  // namespace palpate
