// Shape functions and integration points of the faces of tetrahedra: triangles of three and of six nodes.
//
// In barycentric coordinates L_0 = 1 - xi - eta, L_1 = xi, L_2 = eta of the corners:
//   3 nodes:   N_i = L_i
//   6 nodes:   N_i = L_i (2 L_i - 1) at the corners, N_ij = 4 L_i L_j at the middles of the edges 01 12 20
// The reference triangle has area 1/2. One point at the centroid integrates N_i exactly (Zhong et al. 2005
// eq. (9)). Three points integrate polynomials of degree 2 (Hammer, Marlowe, Stroud 1956), as in CalculiX.
#pragma once

#include <Eigen/Core>
#include <array>

namespace palpate {

template <int kNodes>
struct FaceShape {
  static_assert(kNodes == 3 || kNodes == 6);
  static constexpr int kPoints = kNodes == 3 ? 1 : 3;
  static constexpr double kWeight = 0.5 / kPoints;

  Eigen::Matrix<double, kNodes, 1> values;
  Eigen::Matrix<double, kNodes, 1> d_xi;
  Eigen::Matrix<double, kNodes, 1> d_eta;

  explicit FaceShape(int point) {
    Eigen::Vector3d L = Eigen::Vector3d::Constant(kNodes == 3 ? 1.0 / 3.0 : 1.0 / 6.0);
    if constexpr (kNodes == 3) {
      values = L;
      d_xi = Eigen::Vector3d(-1, 1, 0);
      d_eta = Eigen::Vector3d(-1, 0, 1);
    } else {
      L[point] = 2.0 / 3.0;
      Eigen::Matrix<double, 6, 3> dL = Eigen::Matrix<double, 6, 3>::Zero();  // treats the L_i as independent
      for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3;
        values[i] = L[i] * (2.0 * L[i] - 1.0);
        dL(i, i) = 4.0 * L[i] - 1.0;
        values[3 + i] = 4.0 * L[i] * L[j];
        dL(3 + i, i) = 4.0 * L[j];
        dL(3 + i, j) = 4.0 * L[i];
      }
      d_xi = dL.col(1) - dL.col(0);
      d_eta = dL.col(2) - dL.col(0);
    }
  }
};

}  // namespace palpate
