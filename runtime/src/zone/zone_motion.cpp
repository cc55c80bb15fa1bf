#include "runtime/src/zone/zone_motion.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_tangent.hpp"

namespace palpate {
namespace {

constexpr double kMostTrend = 2;  // limit of |s|, because the last frame predicts little of a longer step

double norm(const double v[3]) {
  return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

// Returns a bound of the patch's motion as the rotation's centre shifts by w: |(1 - R) w| <= angle |w|.
double length_of_shift(const ZoneSet& set, uint32_t contact) {
  double w[3];
  for (int i = 0; i < 3; ++i) w[i] = set.places[contact][i] - set.points[contact][i];
  return norm(w) * norm(set.followed + 3 * (set.num_contacts + contact));
}

bool patches_turn(const ZoneGroup& group) {
  return group.num_axes > 3 * group.num_contacts;
}

// Whether the tangent explains most of Du. Other groups, inclusions and earlier residuals cause the rest.
bool tangent_explains_trend(const ZoneFrame& frame, const ZoneGroup& group) {
  constexpr double kMostUnexplained = 0.5;
  double* expected = frame.work.vector;
  memset(expected, 0, group.unknowns * sizeof *expected);
  for (uint32_t axis = 0; axis < group.num_axes; ++axis) {
    const double* row = sensitivity(group, axis);
    for (uint32_t i = 0; i < group.unknowns; ++i) expected[i] -= row[i] * group.trend.axes[axis];
  }
  double largest = 0;
  double largest_unexplained = 0;
  for (uint32_t i = 0; i < num_moving(group); ++i) {
    largest = std::max(largest, fabs(expected[i]));
    largest_unexplained = std::max(largest_unexplained, fabs(group.trend.unknowns[i] - expected[i]));
  }
  return largest_unexplained <= kMostUnexplained * largest;
}

// Returns s, or zero where there is no trend or tangent, or where contacts stood still.
double trend_factor(const ZoneFrame& frame, const double* change, const ZoneGroup& group) {
  if (!group.trend.is_good || !group.has_tangent) return 0;
  double along = 0;
  double square = 0;
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const double unit = length_of(frame, contact_axis(frame.set, group, i), 1);
    along += unit * change[i] * unit * group.trend.axes[i];
    square += unit * group.trend.axes[i] * unit * group.trend.axes[i];
  }
  const double still = kStill * frame.pack.mean_surface_edge;
  return square > still * still ? std::max(-kMostTrend, std::min(kMostTrend, along / square)) : 0;
}

// A step of a group's contacts, planned once and tried in parts.
struct Step {
  double before[kMostZoneAxes];         // axes of the set before the step
  double points[kMostZoneContacts][3];  // points that patches turn about, before the step
  double goal[kMostZoneAxes];  // axes of the set after the whole step; only those of the group are set
  double within_limit;         // part of the way from the last equilibrium to the wanted axes
  double length;               // of the whole step, in the model's unit
  double part;                 // of the whole step, to be tried
  double trend;                // s
};

// Sets the goal within ZoneGroup::setbacks.longest_step from the last equilibrium.
void plan_step(const ZoneFrame& frame, const ZoneGroup& group, const double* wanted, Step& step) {
  const ZoneSet& set = frame.set;
  memcpy(step.before, set.followed, set.num_axes * sizeof *step.before);
  memcpy(step.points, set.points, set.num_contacts * sizeof *step.points);
  double shift = 0;
  for (uint32_t slot = 0; slot < group.num_contacts && patches_turn(group); ++slot)
    shift = std::max(shift, length_of_shift(set, group.contacts[slot]));
  const double* balanced = set.balanced.followed;
  double from_equilibrium = shift;
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const uint32_t at = contact_axis(set, group, i);
    from_equilibrium = std::max(from_equilibrium, length_of(frame, at, wanted[at] - balanced[at]));
  }
  const double limit = group.setbacks.longest_step * frame.pack.mean_surface_edge;
  step.within_limit = from_equilibrium > limit ? limit / from_equilibrium : 1.0;
  step.length = step.within_limit * shift;
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const uint32_t at = contact_axis(set, group, i);
    step.goal[at] = balanced[at] + step.within_limit * (wanted[at] - balanced[at]);
    step.length = std::max(step.length, length_of(frame, at, step.goal[at] - step.before[at]));
  }
  double change[kMostZoneAxes];
  find_change(set, group, step.before, step.goal, change);
  step.part = 1;
  step.trend = trend_factor(frame, change, group);
}

// Moves contacts by Step::part and predicts the unknowns. Returns false where an element is inverted.
bool try_step(ZoneFrame& frame, ZoneGroup& group, const Step& step) {
  ZoneSet& set = frame.set;
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const uint32_t at = contact_axis(set, group, i);
    set.followed[at] = step.before[at] + step.part * (step.goal[at] - step.before[at]);
  }
  for (uint32_t slot = 0; slot < group.num_contacts && patches_turn(group); ++slot) {
    const uint32_t contact = group.contacts[slot];
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const double before = step.points[contact][axis];
      set.points[contact][axis] =
          before + step.within_limit * step.part * (set.places[contact][axis] - before);
    }
  }
  double change[kMostZoneAxes];
  find_change(set, group, step.before, set.followed, change);
  const double trend = step.part * step.trend;
  for (uint32_t i = 0; i < group.num_axes && group.has_tangent; ++i)
    add_to_unknowns(frame, group, sensitivity(group, i), trend * group.trend.axes[i] - change[i]);
  if (trend != 0) add_to_unknowns(frame, group, group.trend.unknowns, trend);
  place_held(frame, group);
  return evaluate_group(frame, group);
}

void undo_step(ZoneFrame& frame, ZoneGroup& group, const Step& step) {
  ZoneSet& set = frame.set;
  restore_group(frame, group);
  memcpy(set.followed, step.before, set.num_axes * sizeof *step.before);
  memcpy(set.points, step.points, set.num_contacts * sizeof *step.points);
  if (patches_turn(group)) place_held(frame, group);  // restores ZoneMaster::arm
}

}  // namespace

void find_change(const ZoneSet& set, const ZoneGroup& group, const double* from, const double* to,
                 double* change) {
  for (uint32_t i = 0; i < 3 * group.num_contacts; ++i) {
    const uint32_t at = contact_axis(set, group, i);
    change[i] = to[at] - from[at];
  }
  for (uint32_t slot = 0; slot < group.num_contacts && patches_turn(group); ++slot) {
    const uint32_t at = 3 * (set.num_contacts + group.contacts[slot]);
    find_turn_change(from + at, to + at, change + 3 * (group.num_contacts + slot));
  }
}

void place_held(ZoneFrame& frame, const ZoneGroup& group) {
  ZoneSet& set = frame.set;
  const uint32_t first = first_boundary(group) + group.num_boundary;
  Rotation rotations[kMostZoneContacts];
  for (uint32_t slot = 0; slot < group.num_contacts && patches_turn(group); ++slot)
    rotations[slot] = patch_rotation(set, group.contacts[slot]);
  for (uint32_t i = first; i < first + group.num_held; ++i) {
    double* to = set.displacement + size_t{3} * i;
    memcpy(to, node_at(frame.pack, set, i).displacement, 3 * sizeof *to);
    for (uint32_t m = set.first_master[i]; m < set.first_master[i + 1]; ++m) {
      ZoneMaster& master = set.masters[m];
      const uint32_t slot = (master.unknown - group.unknowns) / 3;
      const double* d = set.followed + 3 * group.contacts[slot];
      for (int axis = 0; axis < 3; ++axis) to[axis] += master.share * d[axis];
      if (master.turn == kNoUnknown) continue;
      double arm[3];
      rest_arm(frame.pack, set, group.contacts[slot], set.nodes[i], arm);
      rotate(rotations[slot], arm, master.arm);
      for (int axis = 0; axis < 3; ++axis) to[axis] += master.share * (master.arm[axis] - arm[axis]);
    }
  }
}

double length_of(const ZoneFrame& frame, uint32_t axis, double change) {
  const double arm = std::max(frame.pack.tip_radius, frame.pack.mean_surface_edge);
  return fabs(change) * (axis < 3 * frame.set.num_contacts ? 1.0 : arm);
}

void add_to_unknowns(const ZoneFrame& frame, const ZoneGroup& group, const double* change, double factor) {
  double* u = frame.set.displacement + size_t{3} * group.first_node;
  for (uint32_t i = 0; i < num_moving(group); ++i) u[i] += factor * change[i];
}

void save_group(const ZoneFrame& frame, const ZoneGroup& group) {
  const size_t first = size_t{3} * group.first_node;
  memcpy(frame.work.saved + first, frame.set.displacement + first,
         size_t{3} * group.num_nodes * sizeof(double));
}

void restore_group(ZoneFrame& frame, const ZoneGroup& group) {
  const size_t first = size_t{3} * group.first_node;
  memcpy(frame.set.displacement + first, frame.work.saved + first,
         size_t{3} * group.num_nodes * sizeof(double));
}

void count_move(ZoneGroup& group, double length) {
  group.tangent.moved += length;
  group.tangent.moved_since += length;
}

void move_contacts(ZoneFrame& frame, ZoneGroup& group, const double* wanted) {
  save_group(frame, group);
  Step step;
  plan_step(frame, group, wanted, step);
  group.trend.is_good = false;
  bool is_taken = false;
  for (uint32_t cut = 0; cut <= kMostCuts && !is_taken;) {
    is_taken = try_step(frame, group, step);
    if (is_taken) break;
    undo_step(frame, group, step);
    // The trend alone may invert an element, so the next attempt leaves the trend out.
    if (step.trend != 0) {
      step.trend = 0;
    } else {
      step.part *= 0.5;
      ++cut;
    }
  }
  group.setbacks.jammed = is_taken ? 0 : group.setbacks.jammed + 1;
  if (is_taken) {
    follow_pressures(group.batches, frame.work.saved, frame.set.displacement, 0);
    count_move(group, step.part * step.length);
  } else {
    evaluate_group(frame, group);  // computes the forces of the unmoved group
  }
  if (!is_taken || step.within_limit * step.part < 1) frame.flags |= PAL_FLAG_UNCONVERGED;
  for (uint32_t i = 0; i < group.num_axes; ++i)
    group.trend.axes_began[i] = step.before[contact_axis(frame.set, group, i)];
  memcpy(group.trend.began, frame.work.saved + size_t{3} * group.first_node,
         num_moving(group) * sizeof *group.trend.began);
}

void keep_trend(const ZoneFrame& frame, ZoneGroup& group) {
  if (!group.has_tangent) return;
  const double* u = frame.set.displacement + size_t{3} * group.first_node;
  for (uint32_t i = 0; i < num_moving(group); ++i) group.trend.unknowns[i] = u[i] - group.trend.began[i];
  double before[kMostZoneAxes];
  for (uint32_t i = 0; i < group.num_axes; ++i)
    before[contact_axis(frame.set, group, i)] = group.trend.axes_began[i];
  find_change(frame.set, group, before, frame.set.followed, group.trend.axes);
  group.trend.is_good = tangent_explains_trend(frame, group);
}

}  // namespace palpate
