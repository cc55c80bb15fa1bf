// Shape functions and integration points of the four-node and the ten-node tetrahedron.
//
// In barycentric coordinates L_0 .. L_3 of the corners:
//   4 nodes:   N_i = L_i
//   10 nodes:  N_i = L_i (2 L_i - 1) at the corners, N_ij = 4 L_i L_j at the middles of the edges
//              01 12 02 03 13 23, in the order of Abaqus' C3D10 and of VTK.
// Local coordinates are L_1, L_2, L_3; the reference element has volume 1/6. Four-node elements use one point
// at the centroid. Ten-node elements use four points, exact for polynomials of degree 2 (Hammer, Marlowe,
// Stroud 1956): the volume of an element with curved edges is approximate.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <array>
#include <cmath>

namespace palpate {

// The two corners of each edge, in the order of the ten-node element's middle nodes.
inline constexpr std::array<std::array<int, 2>, 6> kTetrahedronEdges = {
    {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};

template <int kNodes>
struct TetrahedronShape {
  static_assert(kNodes == 4 || kNodes == 10);
  static constexpr int kPoints = kNodes == 4 ? 1 : 4;
  using Nodal = Eigen::Matrix<double, 3, kNodes>;  // a column for each node

  // Returns the barycentric coordinates of an integration point. All points have equal weights.
  static Eigen::Vector4d point(int index) {
    if constexpr (kNodes == 4) return Eigen::Vector4d::Constant(0.25);
    Eigen::Vector4d L = Eigen::Vector4d::Constant((5.0 - std::sqrt(5.0)) / 20.0);
    L[index] = (5.0 + 3.0 * std::sqrt(5.0)) / 20.0;
    return L;
  }

  // Returns N_a at L, for each node a.
  static Eigen::Matrix<double, kNodes, 1> values(const Eigen::Vector4d& L) {
    if constexpr (kNodes == 4) {
      return L;
    } else {
      Eigen::Matrix<double, kNodes, 1> N;
      for (int i = 0; i < 4; ++i) N[i] = L[i] * (2.0 * L[i] - 1.0);
      for (int edge = 0; edge < 6; ++edge) {
        const auto [i, j] = kTetrahedronEdges[static_cast<size_t>(edge)];
        N[4 + edge] = 4.0 * L[i] * L[j];
      }
      return N;
    }
  }

  // Returns dN_a / dL_i for i = 1 .. 3, with L_0 = 1 - L_1 - L_2 - L_3.
  static Nodal local_gradients(const Eigen::Vector4d& L) {
    // dN_a / dL_i as if the four L_i were independent; the last line subtracts the row of the dependent L_0.
    Eigen::Matrix<double, 4, kNodes> dN = Eigen::Matrix<double, 4, kNodes>::Zero();
    for (int i = 0; i < 4; ++i) dN(i, i) = kNodes == 4 ? 1.0 : 4.0 * L[i] - 1.0;
    if constexpr (kNodes == 10) {
      for (int edge = 0; edge < 6; ++edge) {
        const auto [i, j] = kTetrahedronEdges[static_cast<size_t>(edge)];
        dN(i, 4 + edge) = 4.0 * L[j];
        dN(j, 4 + edge) = 4.0 * L[i];
      }
    }
    return dN.template bottomRows<3>().rowwise() - dN.row(0);
  }
};

// dN_a/dX at an integration point of an element with the given node positions, and the share of the point in
// the volume of the element.
template <int kNodes>
struct ShapeAtPoint {
  typename TetrahedronShape<kNodes>::Nodal gradients;
  double volume = 0;  // not above 0 where the element is inverted; gradients are undefined at 0

  ShapeAtPoint(const typename TetrahedronShape<kNodes>::Nodal& positions, int point) {
    using Shape = TetrahedronShape<kNodes>;
    const typename Shape::Nodal local = Shape::local_gradients(Shape::point(point));
    // dX_i / dL_j. Positions relative to the first node keep all digits far from the origin; the local
    // gradients sum to 0.
    const Eigen::Matrix3d jacobian = (positions.colwise() - positions.col(0).eval()) * local.transpose();
    volume = jacobian.determinant() / (6.0 * Shape::kPoints);
    gradients = jacobian.inverse().transpose() * local;
  }
};

}  // namespace palpate
