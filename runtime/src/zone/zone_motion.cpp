#include "runtime/src/zone/zone_motion.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_tangent.hpp"

namespace palpate {
namespace {

constexpr double kMostTrend = 2;  // s: a tool that is suddenly faster than that may as well go elsewhere

double norm(const double v[3]) {
  return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

// How far the patch of a contact goes at most as the point that it turns about does: |R - 1| is the length of its turn.
double length_of_place(const ZoneSet& set, uint32_t contact) {
  double way[3];
  for (int i = 0; i < 3; ++i) way[i] = set.places[contact][i] - set.points[contact][i];
  return norm(way) * norm(set.followed + 3 * (set.num_contacts + contact));
}

bool turns(const ZoneGroup& group) {
  return group.num_axes > 3 * group.num_contacts;
}

// Whether Du is what Dd has brought about, as far as a tangent tells: it may also be what others, an inclusion or an
// error before it have.
bool is_of_axes(const ZoneGroup& group) {
  constexpr double kMostElse = 0.5;
  double largest = 0;
  double largest_else = 0;
  for (uint32_t i = 0; i < num_moving(group); ++i) {
    double expected = 0;
    for (uint32_t axis = 0; axis < group.num_axes; ++axis)
      expected -= sensitivity(group, axis)[i] * group.axes_trend[axis];
    largest = std::max(largest, fabs(expected));
    largest_else = std::max(largest_else, fabs(group.trend[i] - expected));
  }
  return largest_else <= kMostElse * largest;
}

// s; zero where no trend is known.
double part_of_trend(const ZoneFrame& frame, const double* change, const ZoneGroup& group) {
  if (!group.has_trend || !group.has_tangent) return 0;
  double along = 0;
  double square = 0;
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const double unit = length_of(frame, contact_axis(frame.set, group, i), 1);
    along += unit * change[i] * unit * group.axes_trend[i];
    square += unit * group.axes_trend[i] * unit * group.axes_trend[i];
  }
  const double still = kStill * frame.pack.mean_surface_edge;
  return square > still * still ? std::max(-kMostTrend, std::min(kMostTrend, along / square)) : 0;
}

}  // namespace

void find_change(const ZoneSet& set, const ZoneGroup& group, const double* from, const double* to,
                 double* change) {
  for (uint32_t i = 0; i < 3 * group.num_contacts; ++i) {
    const uint32_t at = contact_axis(set, group, i);
    change[i] = to[at] - from[at];
  }
  for (uint32_t slot = 0; slot < group.num_contacts && turns(group); ++slot) {
    const uint32_t at = 3 * (set.num_contacts + group.contacts[slot]);
    double was[4];
    double is[4];
    quaternion_of(from + at, was);
    quaternion_of(to + at, is);
    turn_between(was, is, change + 3 * (group.num_contacts + slot));
  }
}

void place_held(ZoneFrame& frame, const ZoneGroup& group) {
  ZoneSet& set = frame.set;
  const uint32_t first = first_boundary(group) + group.num_boundary;
  Rotation rotations[kMostZoneContacts];
  for (uint32_t slot = 0; slot < group.num_contacts && turns(group); ++slot)
    rotations[slot] = patch_rotation(set, group.contacts[slot]);
  for (uint32_t i = first; i < first + group.num_held; ++i) {
    double* to = set.displacement + size_t{3} * i;
    memcpy(to, frame.pack.zone_nodes[set.nodes[i]].displacement, 3 * sizeof *to);
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

void count_move(ZoneFrame& frame, ZoneGroup& group, double length) {
  group.moved += length;
  group.moved_since += length;
  for (uint32_t g = 0; g < frame.set.num_groups; ++g) {
    if (&frame.set.groups[g] != &group) frame.set.groups[g].others_moved += length;
  }
}

void move_contacts(ZoneFrame& frame, ZoneGroup& group, const double* wanted) {
  ZoneSet& set = frame.set;
  save_group(frame, group);
  double before[kMostZoneAxes];
  double points[kMostZoneContacts][3];
  memcpy(before, set.followed, set.num_axes * sizeof *before);
  memcpy(points, set.points, set.num_contacts * sizeof *points);
  const double* balanced = set.balanced.followed;
  double longest = 0;
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const uint32_t at = contact_axis(set, group, i);
    longest = std::max(longest, length_of(frame, at, wanted[at] - balanced[at]));
  }
  double slid = 0;
  for (uint32_t slot = 0; slot < group.num_contacts && turns(group); ++slot)
    slid = std::max(slid, length_of_place(set, group.contacts[slot]));
  longest = std::max(longest, slid);
  const double limit = group.longest_step * frame.pack.mean_surface_edge;
  const double within_limit = longest > limit ? limit / longest : 1.0;
  double goal[kMostZoneAxes];
  longest = within_limit * slid;
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const uint32_t at = contact_axis(set, group, i);
    goal[at] = balanced[at] + within_limit * (wanted[at] - balanced[at]);
    longest = std::max(longest, length_of(frame, at, goal[at] - before[at]));
  }
  double part = 1;
  double change[kMostZoneAxes];
  find_change(set, group, before, goal, change);
  double trend = part_of_trend(frame, change, group);
  group.has_trend = false;
  bool is_upright = false;
  for (uint32_t cut = 0; cut <= kMostCuts && !is_upright;) {
    for (uint32_t i = 0; i < group.num_axes; ++i) {
      const uint32_t at = contact_axis(set, group, i);
      set.followed[at] = before[at] + part * (goal[at] - before[at]);
    }
    for (uint32_t slot = 0; slot < group.num_contacts && turns(group); ++slot) {
      const uint32_t contact = group.contacts[slot];
      for (uint32_t axis = 0; axis < 3; ++axis)
        set.points[contact][axis] =
            points[contact][axis] + within_limit * part * (set.places[contact][axis] - points[contact][axis]);
    }
    find_change(set, group, before, set.followed, change);
    for (uint32_t i = 0; i < group.num_axes && group.has_tangent; ++i)
      add_to_unknowns(frame, group, sensitivity(group, i), part * trend * group.axes_trend[i] - change[i]);
    if (trend != 0) add_to_unknowns(frame, group, group.trend, part * trend);
    place_held(frame, group);
    is_upright = evaluate_group(frame, group);
    if (is_upright) {
      follow_pressures(group.batches, frame.work.saved, set.displacement, 0);
      count_move(frame, group, part * longest);
      if (within_limit * part < 1) frame.flags |= PAL_FLAG_UNCONVERGED;
      break;
    }
    restore_group(frame, group);
    memcpy(set.followed, before, set.num_axes * sizeof *before);
    memcpy(set.points, points, set.num_contacts * sizeof *points);
    if (turns(group)) place_held(frame, group);  // for the arms
    if (trend != 0) {
      trend = 0;  // it may be that alone
    } else {
      part *= 0.5;
      ++cut;
    }
  }
  group.jammed = is_upright ? 0 : group.jammed + 1;
  if (!is_upright) {
    evaluate_group(frame, group);
    frame.flags |= PAL_FLAG_UNCONVERGED;
  }
  for (uint32_t i = 0; i < group.num_axes; ++i) group.axes_began[i] = before[contact_axis(set, group, i)];
  memcpy(group.began, frame.work.saved + size_t{3} * group.first_node,
         num_moving(group) * sizeof *group.began);
}

void keep_trend(const ZoneFrame& frame, ZoneGroup& group) {
  if (!group.has_tangent) return;
  const double* u = frame.set.displacement + size_t{3} * group.first_node;
  for (uint32_t i = 0; i < num_moving(group); ++i) group.trend[i] = u[i] - group.began[i];
  double before[kMostZoneAxes];
  for (uint32_t i = 0; i < group.num_axes; ++i)
    before[contact_axis(frame.set, group, i)] = group.axes_began[i];
  find_change(frame.set, group, before, frame.set.followed, group.axes_trend);
  group.has_trend = is_of_axes(group);
}

}  // namespace palpate
