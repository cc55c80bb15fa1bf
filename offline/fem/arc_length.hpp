// The path of equilibria under proportional loads, followed through its limit points by its arc length.
//
// The unknowns are the displacement u and the load factor l of P0 + l (P - P0), from the loads P0 of the state
// before to those of the step, P. With v = du/dl along the equilibria, K v = q = P - P0, and v0 that at the
// start, the length of a piece of path is measured by
//   ds^2 = (dl^2 + |du|^2 / |v0|^2) / 2,
// in which s = l for a body that stays linear, whatever its units and its mesh. The tangent of the path is
//   t = (v, 1) / |(v, 1)|, to the side of the last increment: t . dx > 0,
// finite at a limit point of the load, where v is not. An increment goes ds along t and comes back to the
// equilibria in the plane normal to t (Riks 1979; Keller 1977 calls s the pseudo arc length): Newton's
//   K du = r + dl q,   t . (du, dl) = 0   with   w = K^-1 r:   du = w + dl v,   dl = - t_u . w / (t . (v, 1))
// whose matrix is regular at a simple limit point. The plane takes one root, where the sphere of Crisfield 1981
// has two, at times complex, to choose from. Near a limit point K is indefinite: it is factored with signs, and
// no merit is asked for, since there is no minimum to go down to. An increment that fails, or at whose end the
// tangent has turned by more than 60 degrees, is halved; others change by sqrt(usual / taken iterations) (Ramm
// 1981).
//
// The orientation by the last increment also holds where the path turns back in displacement. That is not so of
// Bergan's procedure, which may be asked for in its place: there the load increment is sized and directed by the
// current stiffness parameter (current_stiffness.hpp),
//   S = (v0 . K0 v0) / (v . K v),   1 at the start, 0 at a limit point of the load,
// and where its sign is against the last increment, the path ends.
#pragma once

#include <functional>
#include <limits>
#include <optional>

#include "offline/fem/path_point.hpp"
#include "offline/fem/static_solver.hpp"

namespace palpate {

// What sizes and directs the next increment. `current_stiffness` is for steps that change loads alone: of a body that
// is moved, S tells the limit points of the reaction, not of the motion.
enum class Stepping { arc_length, current_stiffness };

struct ArcLengthSettings {
  Stepping stepping = Stepping::arc_length;
  // As in SolverSettings, measured against the largest force at play on the path so far: the body may pass a
  // state without any.
  double residual_tolerance = 1e-10;
  int max_iterations = 20;
  int max_increments = 100;
  double first_increment = 1.0;  // of s, which is that of l at the start
  double smallest_increment = 1e-5;
  double largest_increment = std::numeric_limits<double>::infinity();
  // Where the path ends, whichever comes first; without one, after max_increments.
  std::optional<double> end_load_factor;  // above 0
  struct EndDisplacement {
    int dof = 0;
    double value = 0;  // of the whole displacement, not of that since the start
  };
  std::optional<EndDisplacement> end_displacement;
};

// Not thread-safe. Cost: a factor in double precision for each iteration and each point.
class ArcLength {
 public:
  // `assembly` must outlive it and eliminate only dofs that both load cases hold at zero.
  explicit ArcLength(const Assembly& assembly);

  // Follows the path from `displacement`, the equilibrium of `from`, in the direction of a growing load. `to`:
  // the loads at the factor 1. `visit` is called at the start and at every point. SolveReport::load_factor is
  // l, and `displacement` the state, at the last point; `converged` where the path came to its end. The last
  // increment ends on the end itself, unless the path turns there.
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
