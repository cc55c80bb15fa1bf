// Follows equilibria under proportional loads through limit points, by arc length.
//
// Unknowns: displacement u and load factor l of the loads P0 + l q. P0 are the loads of the state before the
// step, and P0 + q the loads at its end. With the tangent K v = q, v = du/dl, and v0 = v at the start:
//   ds^2 = (dl^2 + |du|^2 / |v0|^2) / 2          arc length; s = l for a linear body
//   t = (v, 1) / |(v, 1)|,   t . dx > 0          unit tangent, oriented by the last increment dx
// At a limit point v is infinite and t is finite. An increment predicts ds along t, then corrects in the
// plane normal to t (Riks 1979; Keller 1977, pseudo arc length):
//   K du = r + dl q,   t . (du, dl) = 0   with   w = K^-1 r:   du = w + dl v,   dl = - t_u . w / (t . (v, 1))
// This system is regular at a simple limit point. The plane gives one root, Crisfield's sphere (1981) two.
//
// Near a limit point K is indefinite: its factor has signs, and the correction uses no merit function. An
// increment is halved where the correction fails or the tangent turns by more than 60 degrees. The next
// increment is sqrt(usual / taken iterations) times as long (Ramm 1981).
//
// Bergan's procedure is the alternative (current_stiffness.hpp): S = (v0 . K0 v0) / (v . K v) gives the load
// increment. The path ends where the sign of S opposes the last increment.
#pragma once

#include <functional>
#include <limits>
#include <optional>

#include "offline/fem/path_point.hpp"
#include "offline/fem/static_solver.hpp"

namespace palpate {

// Selects the control of the next increment. `current_stiffness` requires steps that change loads alone:
// under prescribed displacements S shows limit points of the reaction.
enum class Stepping { arc_length, current_stiffness };

struct ArcLengthSettings {
  Stepping stepping = Stepping::arc_length;
  // As in SolverSettings, but relative to the largest force scale of the path so far: a state on the path may
  // have no forces.
  double residual_tolerance = 1e-10;
  int max_iterations = 20;
  int max_increments = 100;
  double first_increment = 1.0;  // increment of s; equals dl at the start
  double smallest_increment = 1e-5;
  double largest_increment = std::numeric_limits<double>::infinity();
  // The path ends at the first of these conditions, or after max_increments.
  std::optional<double> end_load_factor;  // above 0
  struct EndDisplacement {
    int dof = 0;
    double value = 0;  // total displacement, not relative to the start
  };
  std::optional<EndDisplacement> end_displacement;
};

// Not thread-safe. Cost: a double-precision factor for each iteration and each point.
class ArcLength {
 public:
  // `assembly` must outlive the object and eliminate only dofs that both load cases hold at zero.
  explicit ArcLength(const Assembly& assembly);

  // Follows the path from `displacement`, the equilibrium of `from`, in the direction of growing load. `to`
  // are the loads at l = 1. `visit` receives the start and every point. On return SolveReport::load_factor
  // and `displacement` are the last point. `converged` means that the path reached its end condition. The
  // last increment ends exactly on the condition, unless the path turns there.
  SolveReport follow(const LoadCase& from, const LoadCase& to, Eigen::VectorXd& displacement,
                     const ArcLengthSettings& settings,
                     const std::function<void(const PathPoint&, const Eigen::VectorXd&)>& visit,
                     const std::function<void(const IterationRecord&)>& progress = {});

  const SolveSeconds& seconds() const { return seconds_; }

 private:
  class Path;

  const Assembly* assembly_;
  Cholesky cholesky_;
  SolveSeconds seconds_;
};

}  // namespace palpate
