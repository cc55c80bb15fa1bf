// Four elements of one kind side by side, one in each vector lane. Each lane does the same operations in the
// same order on every instruction set, so all IEEE 754 machines give the same bits.
//
// With the shape gradients g_a at a point of volume V, and the stress and tangent of dyadic_tangent.hpp:
//
//   F    = 1 + sum_a u_a g_a^T
//   P_a  = V (identity f_a - transposed h_a),   f_a = F g_a, h_a = H g_a
//   K_ab = V (identity (g_a . g_b) 1 + transposed h_b h_a^T
//             + h_a (hh h_b + fh f_b)^T + f_a (fh h_b + ff f_b)^T)
#pragma once

#include <array>

#include "runtime/kernels/dyadic_tangent.hpp"
#include "runtime/kernels/lanes.hpp"

namespace palpate {

// Nodal vectors of four elements: [node][axis].
template <int kNodes>
using NodalLanes = std::array<std::array<Lanes, 3>, kNodes>;
// The lower triangle of an element stiffness, a >= b over the element's dofs, column by column.
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

// Indexed as [i][J].
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

// Gathers nodal values of a batch from an array of 3 per node.
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

// Adds the nodal values of the first `lanes` lanes to an array of 3 per node.
template <int kNodes>
void scatter(const ElementBatch<kNodes>& batch, int lanes, const NodalLanes<kNodes>& nodal, double* values) {
  for (size_t a = 0; a < kNodes; ++a) {
    for (int lane = 0; lane < lanes; ++lane) {
      double* node = values + 3 * static_cast<size_t>(batch.nodes[a][static_cast<size_t>(lane)]);
      for (size_t i = 0; i < 3; ++i) node[i] += nodal[a][i][lane];
    }
  }
}

// The batch operations for the best instruction set of the processor.
template <int kNodes>
struct BatchKernels {
  using Point = typename ElementBatch<kNodes>::Point;
  using Stiffness = StiffnessLanes<kNodes>;

  void (*deform)(const Point& point, const NodalLanes<kNodes>& displacement, KinematicsLanes& kinematics);
  // The next two functions add to their last argument.
  void (*add_force)(const Point& point, const KinematicsLanes& kinematics, const DyadicLanes& terms,
                    NodalLanes<kNodes>& force);
  void (*add_stiffness)(const Point& point, const KinematicsLanes& kinematics, const DyadicLanes& terms,
                        Stiffness& stiffness);
};

// kNodes is 4 or 10.
template <int kNodes>
const BatchKernels<kNodes>& batch_kernels();
// The operations for the baseline instruction set, which give the same bits.
template <int kNodes>
const BatchKernels<kNodes>& portable_batch_kernels();

}  // namespace palpate
