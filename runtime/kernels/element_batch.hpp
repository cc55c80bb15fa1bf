// Four elements of one kind side by side, each in a lane of the processor's vectors: what an element costs
// then is a quarter of the arithmetic. The lanes do the same operations in the same order whatever the
// instruction set, so every machine that rounds as IEEE 754 says gives the same bits.
//
// With the shape gradients g_a at a point that stands for the volume V, and the stress and tangent of
// dyadic_tangent.hpp:
//
//   F    = 1 + sum_a u_a g_a^T
//   P_a  = V (identity f_a - transposed h_a),   f_a = F g_a, h_a = H g_a
//   K_ab = V (identity (g_a . g_b) 1 + transposed h_b h_a^T
//             + h_a (hh h_b + fh f_b)^T + f_a (fh h_b + ff f_b)^T)
//
// Of second order in the displacements, at F = 1, any isotropic law whose stress is zero there has with E the strain of
// Green
//
//   W = lambda/2 (tr E)^2 + mu tr E^2 + nu1/6 (tr E)^3 + nu2 tr E tr E^2 + 4/3 nu3 tr E^3 + ...
//
// (Toupin and Bernstein 1961), so for gradients A and B of two displacements, e_A and e_B their symmetric parts and
// S(e) = lambda tr e 1 + 2 mu e, the symmetric bilinear part of its stress is
//
//   P2(A, B) = (A S(e_B) + B S(e_A)) / 2 + S(sym(A^T B)) / 2 + (nu1/2 tr A tr B + nu2 e_A : e_B) 1
//              + nu2 (tr A e_B + tr B e_A) + 2 nu3 (e_A e_B + e_B e_A)
#pragma once

#include <array>

#include "runtime/kernels/dyadic_tangent.hpp"
#include "runtime/kernels/lanes.hpp"

namespace palpate {

// An element's arrays, each number in four lanes.
template <int kNodes>
using NodalLanes = std::array<std::array<Lanes, 3>, kNodes>;
// The lower triangle of a stiffness, a >= b over the dofs of the element, column by column.
template <int kNodes>
using StiffnessLanes = std::array<Lanes, static_cast<size_t>(3 * kNodes * (3 * kNodes + 1) / 2)>;

template <int kNodes>
struct ElementBatch {
  static constexpr int kPoints = kNodes == 4 ? 1 : 4;  // integration points
  struct Point {
    NodalLanes<kNodes> gradients;
    Lanes volume;
  };
  std::array<std::array<int, kLanes>, kNodes> nodes;
  std::array<Point, kPoints> points;
};

// At [i][J].
using MatrixLanes = std::array<std::array<Lanes, 3>, 3>;

struct KinematicsLanes {
  MatrixLanes F;
  MatrixLanes H;  // F^-T
  Lanes I1;
  Lanes J;
};

// A DyadicTangent in each lane.
struct DyadicLanes {
  Lanes identity;
  Lanes transposed;
  Lanes ff;
  Lanes fh;
  Lanes hh;

  void set(int lane, const DyadicTangent& terms) {
    identity.set(lane, terms.identity);
    transposed.set(lane, terms.transposed);
    ff.set(lane, terms.ff);
    fh.set(lane, terms.fh);
    hh.set(lane, terms.hh);
  }
};

// The constants of P2 in each lane. Where stress is linear in the displacements all are zero.
struct SecondOrderLanes {
  Lanes lambda;
  Lanes mu;
  Lanes nu1;
  Lanes nu2;
  Lanes nu3;
};

// The values at the nodes of a batch, from an array of 3 per node.
template <int kNodes>
NodalLanes<kNodes> gather(const ElementBatch<kNodes>& batch, const double* values) {
  NodalLanes<kNodes> nodal;
  for (size_t a = 0; a < kNodes; ++a) {
    for (size_t i = 0; i < 3; ++i) {
      for (int lane = 0; lane < kLanes; ++lane)
        nodal[a][i].set(lane, values[3 * static_cast<size_t>(batch.nodes[a][static_cast<size_t>(lane)]) + i]);
    }
  }
  return nodal;
}

// Adds those of the first lanes, so many, to an array of 3 per node.
template <int kNodes>
void scatter(const ElementBatch<kNodes>& batch, int lanes, const NodalLanes<kNodes>& nodal, double* values) {
  for (size_t a = 0; a < kNodes; ++a) {
    for (int lane = 0; lane < lanes; ++lane) {
      double* node = values + 3 * static_cast<size_t>(batch.nodes[a][static_cast<size_t>(lane)]);
      for (size_t i = 0; i < 3; ++i) node[i] += nodal[a][i][lane];
    }
  }
}

// The arithmetic of a batch, for the best instruction set that the processor has.
template <int kNodes>
struct BatchKernels {
  using Point = typename ElementBatch<kNodes>::Point;
  using Stiffness = StiffnessLanes<kNodes>;

  void (*deform)(const Point& point, const NodalLanes<kNodes>& displacement, KinematicsLanes& kinematics);
  // Both add to what is there.
  void (*add_force)(const Point& point, const KinematicsLanes& kinematics, const DyadicLanes& terms,
                    NodalLanes<kNodes>& force);
  void (*add_stiffness)(const Point& point, const KinematicsLanes& kinematics, const DyadicLanes& terms,
                        Stiffness& stiffness);
  // P2(A, B) of F = 1 + A and 1 + B; `squares` := |(A + B) / 2|^2. The same of any kind.
  void (*find_second_order)(const SecondOrderLanes& law, const MatrixLanes& a, const MatrixLanes& b,
                            MatrixLanes& stress, Lanes& squares);
};

// For elements of 4 and of 10 nodes.
template <int kNodes>
const BatchKernels<kNodes>& batch_kernels();
// With the instructions that every processor has: the same bits.
template <int kNodes>
const BatchKernels<kNodes>& portable_batch_kernels();

}  // namespace palpate
