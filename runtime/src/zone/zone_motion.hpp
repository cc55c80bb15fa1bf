// Moves the contacts of a group, and predicts how its nodes follow.
//
// u are the unknown displacements of the group and d its contact axes: displacements and patch rotations. X = -du/dd
// comes from the current tangent. Du and Dd are the changes of u and d in the last frame. A frame that moves the
// contacts by m begins at
//
//   u + s Du - X (m - s Dd),    s = m . Dd / |Dd|^2, within -2 and 2, with axes weighted by length_of()
//
// This is one rank-one update of X by the last frame (Broyden 1965, Math. Comp. 19). At a steady speed v the error of
// the prediction is proportional to v^2. With an old tangent alone it is proportional to v times the tangent's age.
#pragma once

#include "runtime/src/zone/zone_balance.hpp"

namespace palpate {

// The most halvings of a step that would invert an element.
inline constexpr uint32_t kMostCuts = 6;

// Places the held nodes: the displacement that the pack gives the node, plus the shares of d + (R - 1) r of its
// masters. R is the rotation of the patch, r the arm at rest. Also writes ZoneMaster::arm = R r.
void place_held(ZoneFrame& frame, const ZoneGroup& group);

// The length that stands for a change of one axis of the set. A rotation counts by an arm: the larger of tip radius and
// mean surface edge.
double length_of(const ZoneFrame& frame, uint32_t axis, double change);

// The change of the group's axes between two vectors of the set's axes: differences of displacements, and rotation
// vectors from one patch rotation to the other.
void find_change(const ZoneSet& set, const ZoneGroup& group, const double* from, const double* to,
                 double* change);

// Adds factor times `change` [unknowns] to the displacements of the unknowns.
void add_to_unknowns(const ZoneFrame& frame, const ZoneGroup& group, const double* change, double factor);

// Copies the displacements of the group's nodes to ZoneWork::saved, and back.
void save_group(const ZoneFrame& frame, const ZoneGroup& group);
void restore_group(ZoneFrame& frame, const ZoneGroup& group);

// Adds a length to `moved` and `moved_since` of the group.
void count_move(ZoneGroup& group, double length);

// Moves the contacts towards `wanted` [axes of the set] and predicts the unknowns. The step ends within
// ZoneGroup::setbacks.longest_step mean surface edges of the last equilibrium, and is halved while an element is inverted. Sets
// PAL_FLAG_UNCONVERGED where the contacts miss `wanted`. ZoneGroup::setbacks.jammed counts frames in a row without any step.
void move_contacts(ZoneFrame& frame, ZoneGroup& group, const double* wanted);

// Stores Du and Dd of this frame. The next frame uses them only if the tangent explains most of Du.
void keep_trend(const ZoneFrame& frame, ZoneGroup& group);

}  // namespace palpate
