// Reference: Euler's elastica, an inextensible cantilever under a dead force P at its tip.
//
// theta(s) is the angle of the tangent. The moment at s balances the force about s:
//   EI theta' = (r(L) - r(s)) x P,   so   EI theta'' = P_x sin theta - P_y cos theta
//   theta(0) = 0,   theta'(L) = 0
//
// Source: Euler 1744; Love, Treatise on the Mathematical Theory of Elasticity, chapter XIX. Method: shooting
// from the tip; bisection on the tip's angle until theta(0) = 0. Units: lengths L, forces EI / L^2.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <numbers>

namespace palpate::test {

struct ElasticaTip {
  double angle = 0;  // of the tangent, radians
  double x = 0;      // along the undeformed beam, over L
  double y = 0;      // across the undeformed beam, over L
};

// The equilibrium shape with a tip angle in [low, high]. theta at the clamp is negative for `low` and
// positive for `high`.
inline ElasticaTip elastica(const Eigen::Vector2d& force, double low, double high) {
  constexpr int kSteps = 2000;  // fourth order: an error of about 1e-12
  // theta, d theta / ds toward the clamp, and the position relative to the tip.
  const auto slope = [&](const Eigen::Vector4d& state) {
    return Eigen::Vector4d(state[1], force.x() * std::sin(state[0]) - force.y() * std::cos(state[0]),
                           std::cos(state[0]), std::sin(state[0]));
  };
  const auto at_clamp = [&](double tip_angle) {
    Eigen::Vector4d state(tip_angle, 0, 0, 0);
    const double h = 1.0 / kSteps;
    for (int i = 0; i < kSteps; ++i) {
      const Eigen::Vector4d a = slope(state);
      const Eigen::Vector4d b = slope(state + 0.5 * h * a);
      const Eigen::Vector4d c = slope(state + 0.5 * h * b);
      const Eigen::Vector4d d = slope(state + h * c);
      state += h / 6 * (a + 2 * b + 2 * c + d);
    }
    return state;
  };
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (at_clamp(middle)[0] < 0 ? low : high) = middle;
  }
  const Eigen::Vector4d state = at_clamp(low);
  return {low, state[2], state[3]};
}

// A force across the beam. The tip turns by less than 90 degrees.
inline ElasticaTip elastica_across(double force) {
  return elastica({0, force}, 0.0, 0.5 * std::numbers::pi);
}

// A compression along the beam above Euler's load pi^2 / 4, with a transverse part `aside`. The result is the
// post-buckling shape that a growing load reaches from rest.
inline ElasticaTip elastica_buckled(double force, double aside) {
  return elastica({-force, aside * force}, std::numbers::pi / 3, std::numbers::pi);
}

}  // namespace palpate::test
