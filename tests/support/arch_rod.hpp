// Reference: a clamped circular arch as an extensible Kirchhoff rod, pushed down at its crown, for finite
// rotations.
//
// theta(s) is the angle of the tangent t, a the stretch, F the internal force (constant along the rod). On
// the left half, from the clamp (s = 0) to the crown (s = S):
//   r' = a t,   N(a) = F . t,   I dN/da (theta' - theta_rest') = A M,   M' = - (r' x F)
//   theta(0) = theta_rest(0),   theta(S) = 0,   r(S) as the crown is moved
// Eq. (1) with nu = 0 gives N = EA / 2 (a - 1 / a). dN/da is the tangent modulus of a fibre.
//
// Source: Antman, Nonlinear Problems of Elasticity, chapter IV; Reissner 1972 without shear. Method: shooting
// from the clamp; Newton finds F and M(0) while the crown's deflection grows.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>

#include "tests/support/limit_scenes.hpp"

namespace palpate::test {

class ArchRod {
 public:
  explicit ArchRod(const Arch& arch) : arch_(arch) {}

  // The crown force of the half arch at `deflection`. Successive calls raise `deflection` by less than a
  // tenth of the rise.
  double force(double deflection) {
    for (int iteration = 0; iteration < 30; ++iteration) {
      const Eigen::Vector3d miss = missed(unknown_, deflection);
      if (miss.norm() <= 1e-12 * arch_.radius) break;
      Eigen::Matrix3d slope;
      for (int i = 0; i < 3; ++i) {
        const double size = i == 2 ? arch_.bending_stiffness() / arch_.radius : arch_.bending_stiffness();
        const Eigen::Vector3d change = 1e-6 * size * Eigen::Vector3d::Unit(i);
        slope.col(i) =
            (missed(unknown_ + change, deflection) - missed(unknown_ - change, deflection)) / (2e-6 * size);
      }
      unknown_ -= slope.fullPivLu().solve(miss);
    }
    return -unknown_[1];
  }

 private:
  // Residual of the shooting: theta(S) times the radius, and the crown's position error.
  Eigen::Vector3d missed(const Eigen::Vector3d& unknown, double deflection) const {
    constexpr int kSteps = 200;  // fourth-order Runge-Kutta
    const double curvature = -1 / arch_.radius;
    const auto slope = [&](const Eigen::Vector4d& state) {  // d/ds of theta, M, x, y
      const double c = std::cos(state[0]);
      const double s = std::sin(state[0]);
      const double pull = (unknown[0] * c + unknown[1] * s) / arch_.stretching_stiffness();
      const double stretch = pull + std::sqrt(1 + pull * pull);
      const double bending = 0.5 * (1 + 1 / (stretch * stretch)) * arch_.bending_stiffness();
      return Eigen::Vector4d(curvature + state[1] / bending, -stretch * (c * unknown[1] - s * unknown[0]),
                             stretch * c, stretch * s);
    };
    Eigen::Vector4d state(arch_.half_angle, unknown[2], 0, 0);
    const double h = arch_.length() / kSteps;
    for (int i = 0; i < kSteps; ++i) {
      const Eigen::Vector4d a = slope(state);
      const Eigen::Vector4d b = slope(state + 0.5 * h * a);
      const Eigen::Vector4d c = slope(state + 0.5 * h * b);
      const Eigen::Vector4d d = slope(state + h * c);
      state += h / 6 * (a + 2 * b + 2 * c + d);
    }
    const double rise = arch_.radius * (1 - std::cos(arch_.half_angle));
    return {state[0] * arch_.radius, state[2] - arch_.radius * std::sin(arch_.half_angle),
            state[3] - (rise - deflection)};
  }

  Arch arch_;
  Eigen::Vector3d unknown_ = Eigen::Vector3d::Zero();  // F_x, F_y, M(0)
};

}  // namespace palpate::test
