#include "runtime/src/zone/zone_setback.hpp"

#include <math.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_motion.hpp"

namespace palpate {
namespace {

// More of these lead to a setback (ZoneSetbacks):
constexpr uint32_t kMostStalled = 4;      // solves in a row
constexpr uint32_t kMostJammed = 4;       // solves in a row; a further solve would repeat the jam
constexpr uint32_t kMostFailures = 8;     // setbacks to the balance
constexpr uint32_t kMostNearerRest = 50;  // solves in a row; rest is some ten steps of half an edge away

// Whether a node is much farther from rest than any contact, where the linearised exterior is meaningless.
bool is_lost(const ZoneFrame& frame, const ZoneGroup& group, double size) {
  constexpr double kFarthest = 4;  // over the sum of the contacts' largest displacement and a mean edge
  const double farthest = kFarthest * (size + frame.pack.mean_surface_edge);
  for (uint32_t i = 0; i < num_moving(group); ++i) {
    const uint32_t at = 3 * group.first_node + i;
    const double* rest = node_at(frame.pack, frame.set, at / 3).displacement;
    if (!(fabs(frame.set.displacement[at] - rest[at % 3]) <= farthest)) return true;
  }
  return false;
}

// Returns E' - E less the work of the other groups, which the trapezoidal rule gives (is_unexplained()).
double find_gain(const ZoneFrame& frame, const ZoneGroup& group) {
  const ZoneSet& set = frame.set;
  double gain = group.stored - group.stored_in_balance;
  for (uint32_t i = 0; i < 3 * group.num_boundary && set.num_groups > 1; ++i) {
    const uint32_t at = 3 * first_boundary(group) + i;
    const double rest = node_at(frame.pack, set, at / 3).displacement[at % 3];
    gain -= (0.5 * (set.displacement[at] + set.balanced.displacement[at]) - rest) *
            (group.exterior.coupled[i] - group.exterior.coupled_in_balance[i]);
  }
  return gain;
}

// Whether a group has converged to a wrong equilibrium. Crushed tissue has several equilibria close together,
// and a long step may miss the right equilibrium. The contacts' work from one equilibrium to the next is
//
//   W = sum over their axes of (F + F') / 2 . (d' - d)   =   E' - E,   to second order in d' - d.
//
// E contains q . w with the forces q of the other groups. A change to q' adds (w + w') / 2 . (q' - q), which
// find_gain() subtracts. The group is off its path if
//
//   (E' - E - W)^2 > kMost^2 ((E' - E)^2 + W^2 + kTermWeight^2 (sum of the squares of the terms of W)).
//
// A short step passes, because a difference that persists in short steps belongs to the tissue.
bool is_unexplained(const ZoneFrame& frame, const ZoneGroup& group) {
  constexpr double kMost = 0.05;
  constexpr double kTermWeight = 0.1;  // the terms of W may cancel
  constexpr double kShort = 1.0 / 32;  // longest short step, mean surface edges
  const ZoneSet& set = frame.set;
  if (group.num_contacts == 1 || !group.has_balance) return false;
  double change[kMostZoneAxes];
  find_change(set, group, set.balanced.followed, set.followed, change);
  const double gained = find_gain(frame, group);
  double work = 0;
  double square_terms = 0;
  double square_distance = 0;
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const uint32_t at = contact_axis(set, group, i);
    const double length = length_of(frame, at, change[i]);
    const double term = 0.5 * (set.force[at] + set.balanced.force[at]) * change[i];
    work += term;
    square_terms += term * term;
    square_distance += length * length;
  }
  const double shortest = kShort * frame.pack.mean_surface_edge;
  return square_distance > shortest * shortest &&
         (gained - work) * (gained - work) >
             kMost * kMost * (gained * gained + work * work + kTermWeight * kTermWeight * square_terms);
}

// Returns the distance, a length, of ZoneSetbacks::jammed_goal from the straight path between rest and goal.
double distance_from_jammed_goal(const ZoneFrame& frame, const double* wanted, const ZoneGroup& group) {
  double along = 0;
  double square = 0;
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const uint32_t at = contact_axis(frame.set, group, i);
    const double unit = length_of(frame, at, 1);
    along += unit * wanted[at] * unit * group.setbacks.jammed_goal[i];
    square += unit * wanted[at] * unit * wanted[at];
  }
  const double nearest = square > 0 ? std::max(0.0, std::min(1.0, along / square)) : 0;
  double distance = 0;
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const uint32_t at = contact_axis(frame.set, group, i);
    distance = std::max(distance, length_of(frame, at, nearest * wanted[at] - group.setbacks.jammed_goal[i]));
  }
  return distance;
}

// Updates `nearer_rest` and `retry_distance`. Returns whether the group must restart at rest, in two cases:
// - The goal has been nearer to rest for longer than any path takes. Past a fold Newton may find no path.
// - The contacts are jammed. If the path from rest jams too, the next restart needs a path at least
//   `retry_distance` away, a length that doubles with each restart.
bool must_restart_at_rest(const ZoneFrame& frame, const double* wanted, bool is_done, ZoneGroup& group) {
  constexpr double kFirstRetryDistance = 0.125;  // mean surface edges
  const double edge = frame.pack.mean_surface_edge;
  double from_here = 0;
  double from_rest = 0;
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const uint32_t at = contact_axis(frame.set, group, i);
    from_here = std::max(from_here, length_of(frame, at, wanted[at] - frame.set.followed[at]));
    from_rest = std::max(from_rest, length_of(frame, at, wanted[at]));
  }
  if (is_done && from_here <= kStill * edge) group.setbacks.retry_distance = 0;
  group.setbacks.nearer_rest = from_here > from_rest ? group.setbacks.nearer_rest + 1 : 0;
  if (group.setbacks.jammed <= kMostJammed ||
      distance_from_jammed_goal(frame, wanted, group) < group.setbacks.retry_distance)
    return group.setbacks.nearer_rest > kMostNearerRest;
  for (uint32_t i = 0; i < group.num_axes; ++i)
    group.setbacks.jammed_goal[i] = wanted[contact_axis(frame.set, group, i)];
  group.setbacks.retry_distance = std::max(kFirstRetryDistance * edge, 2 * group.setbacks.retry_distance);
  return true;
}

}  // namespace

Setback find_setback(const ZoneFrame& frame, const double* wanted, double size, bool failed, bool done,
                     ZoneGroup& group) {
  if (must_restart_at_rest(frame, wanted, done, group)) return Setback::to_rest;
  const bool is_stuck = failed || (done && is_unexplained(frame, group)) ||
                        group.setbacks.stalled > kMostStalled ||
                        (frame.flags != frame.set.flags && is_lost(frame, group, size));
  if (!is_stuck) return Setback::none;
  return ++group.setbacks.failures > kMostFailures ? Setback::to_rest : Setback::to_balance;
}

void go_back(ZoneFrame& frame, Setback setback, ZoneGroup& group) {
  constexpr double kShorter = 0.25;
  constexpr double kShortestStep = 1e-3;
  if (setback == Setback::to_rest) {
    rest_group(frame.pack, frame.set, group);
  } else {
    group.setbacks.longest_step = std::max(kShortestStep, kShorter * group.setbacks.longest_step);
    group.setbacks.stalled = 0;
    go_back_to_balance(frame.set, group);
  }
  place_held(frame, group);
  evaluate_group(frame, group);
}

}  // namespace palpate
