#include "runtime/src/zone/zone_setback.hpp"

#include <math.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_motion.hpp"

namespace palpate {
namespace {

constexpr uint32_t kMostAstray = 4;    // solves in a row
constexpr uint32_t kMostJammed = 4;    // solves in a row: the next ones do the same
constexpr uint32_t kMostFailures = 8;  // since it was in balance: it begins anew at rest
constexpr uint32_t kMostLate = 50;     // solves in a row; at half an edge each the way to rest takes some ten

// Whether a node is much farther from rest than any contact has a right to move it, where the linear organ outside says
// nothing any more.
bool is_lost(const ZoneFrame& frame, const ZoneGroup& group, double size) {
  constexpr double kFarthest = 4;  // of the largest displacement of a contact, and a mean edge
  const double farthest = kFarthest * (size + frame.pack.mean_surface_edge);
  for (uint32_t i = 0; i < num_moving(group); ++i) {
    const uint32_t at = 3 * group.first_node + i;
    const double* rest = node_at(frame.pack, frame.set, at / 3).displacement;
    if (!(fabs(frame.set.displacement[at] - rest[at % 3]) <= farthest)) return true;
  }
  return false;
}

// E' - E without the work of the other groups, by the trapezoidal rule.
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

// Whether a group has converged to an equilibrium that its contacts did not lead to. Crushed tissue has other equilibria
// near, and Newton may find one at the end of a long step. From one equilibrium to the next the contacts do the work
//
//   W = sum over their axes of (F + F') / 2 . (d' - d)   =   E' - E,   to second order in d' - d
//
// E holds q . w with the forces q of the other groups. Where they change to q', they do the work (w + w') / 2 . (q' - q),
// which find_gain() takes off.
// On crushed blocks |E' - E - W| was up to 5 % of W in most steps that led right, up to 30 % where forces rose several
// times, and 8 to 150 % in steps that led wrong. The group repeats a step in shorter ones where
//
//   (E' - E - W)^2 > kMost^2 ((E' - E)^2 + W^2 + kOfTerms^2 (sum of the squares of the terms of W))
//
// A difference that stays in short steps is how the tissue moves. A group without an earlier equilibrium is not judged.
bool is_unexplained(const ZoneFrame& frame, const ZoneGroup& group) {
  constexpr double kMost = 0.05;
  constexpr double kOfTerms = 0.1;     // which may cancel
  constexpr double kShort = 1.0 / 32;  // mean edges of the surface
  const ZoneSet& set = frame.set;
  if (group.num_contacts == 1 || !group.has_balance) return false;
  double change[kMostZoneAxes];
  find_change(set, group, set.balanced.followed, set.followed, change);
  const double gained = find_gain(frame, group);
  double work = 0;
  double terms = 0;  // squared
  double way = 0;    // squared
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const uint32_t at = contact_axis(set, group, i);
    const double length = length_of(frame, at, change[i]);
    const double term = 0.5 * (set.force[at] + set.balanced.force[at]) * change[i];
    work += term;
    terms += term * term;
    way += length * length;
  }
  const double shortest = kShort * frame.pack.mean_surface_edge;
  return way > shortest * shortest &&
         (gained - work) * (gained - work) >
             kMost * kMost * (gained * gained + work * work + kOfTerms * kOfTerms * terms);
}

// How far the straight way from rest to where contacts are to be passes by where they were to be when it gave up last.
double distance_from_given_up(const ZoneFrame& frame, const double* wanted, const ZoneGroup& group) {
  double along = 0;
  double square = 0;
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const uint32_t at = contact_axis(frame.set, group, i);
    const double unit = length_of(frame, at, 1);
    along += unit * wanted[at] * unit * group.setbacks.given_up[i];
    square += unit * wanted[at] * unit * wanted[at];
  }
  const double nearest = square > 0 ? std::max(0.0, std::min(1.0, along / square)) : 0;
  double distance = 0;
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const uint32_t at = contact_axis(frame.set, group, i);
    distance = std::max(distance, length_of(frame, at, nearest * wanted[at] - group.setbacks.given_up[i]));
  }
  return distance;
}

// Whether it is to begin anew at rest: its contacts are jammed; or it has looked for longer than any way takes for one to
// where they are nearer to rest than to where it is, as from beyond a fold there may be none that Newton finds. What jams
// on the way from rest, too, stays so until that way is another, each time by twice as much.
bool begins_anew(const ZoneFrame& frame, const double* wanted, bool is_done, ZoneGroup& group) {
  constexpr double kElsewhere = 0.125;  // mean edges of the surface
  const double edge = frame.pack.mean_surface_edge;
  double from_here = 0;
  double from_rest = 0;
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const uint32_t at = contact_axis(frame.set, group, i);
    from_here = std::max(from_here, length_of(frame, at, wanted[at] - frame.set.followed[at]));
    from_rest = std::max(from_rest, length_of(frame, at, wanted[at]));
  }
  if (is_done && from_here <= kStill * edge) group.setbacks.elsewhere = 0;
  group.setbacks.late = from_here > from_rest ? group.setbacks.late + 1 : 0;
  if (group.setbacks.jammed <= kMostJammed ||
      distance_from_given_up(frame, wanted, group) < group.setbacks.elsewhere)
    return group.setbacks.late > kMostLate;
  for (uint32_t i = 0; i < group.num_axes; ++i)
    group.setbacks.given_up[i] = wanted[contact_axis(frame.set, group, i)];
  group.setbacks.elsewhere = std::max(kElsewhere * edge, 2 * group.setbacks.elsewhere);
  return true;
}

}  // namespace

Setback find_setback(const ZoneFrame& frame, const double* wanted, double size, bool failed, bool done,
                     ZoneGroup& group) {
  if (begins_anew(frame, wanted, done, group)) return Setback::to_rest;
  const bool is_stuck = failed || (done && is_unexplained(frame, group)) ||
                        group.setbacks.astray > kMostAstray ||
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
    group.setbacks.astray = 0;
    go_back_to_balance(frame.set, group);
  }
  place_held(frame, group);
  evaluate_group(frame, group);
}

}  // namespace palpate
