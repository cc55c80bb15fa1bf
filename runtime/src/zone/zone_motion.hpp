// Moves the contacts of a group, and predicts how its nodes follow.
//
// u are the unknown displacements of the group, and d its contact axes: displacements and patch rotations.
// X = -du/dd comes from the current tangent. Du and Dd are the changes of u and d in the last frame. A frame
// that moves the contacts by m begins at
//
//   u + s Du - X (m - s Dd),    s = m . Dd / |Dd|^2, within -2 and 2, with axes weighted by length_of()
//
// This is one rank-one update of X by the last frame (Broyden 1965, Math. Comp. 19). At a steady speed v the
// prediction has an error of order v^2. With an old tangent alone the order is v times the tangent's age.
#pragma once

#include "runtime/src/zone/zone_balance.hpp"

namespace palpate {

// The most halvings of a step that would invert an element.
inline constexpr uint32_t kMostCuts = 6;

// Places the nodes that contacts hold, and writes ZoneMaster::arm = R r. R is the patch rotation, and r the
// arm at rest. A held node moves from rest by the shares of d + (R - 1) r of its masters.
void place_held(ZoneFrame& frame, const ZoneGroup& group);

// Returns |change| of one axis of the set as a length. A rotation is multiplied by an arm, the larger of tip
// radius and mean surface edge.
double length_of(const ZoneFrame& frame, uint32_t axis, double change);

// Computes the change of the group's axes between two vectors of the set's axes: differences of
// displacements, and the rotation vector from one patch rotation to the other.
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
// ZoneSetbacks::longest_step of the last equilibrium, and is halved while an element is inverted. Sets
// PAL_FLAG_UNCONVERGED if the contacts miss `wanted`. Updates ZoneSetbacks::jammed.
void move_contacts(ZoneFrame& frame, ZoneGroup& group, const double* wanted);

// Stores Du and Dd of this frame. The next frame uses them only if the tangent explains most of Du.
void keep_trend(const ZoneFrame& frame, ZoneGroup& group);

}  // namespace palpate
