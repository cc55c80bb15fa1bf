// How the contacts of a group move, and how its nodes are expected to follow.
//
// Of unknowns u and the contacts' axes d, with X = -du/dd as the tangent in use has it, and Du, Dd how far they went
// in the frame before, a frame that takes the contacts by dd begins at
//
//   u + s Du - X (dd - s Dd),    s = dd . Dd / |Dd|^2
//
// As far as contacts go on as before, so do nodes: the last frame tells more than a tangent that is some frames old. The rest of the way follows the tangent (Broyden 1965, Math.
// Comp. 19, of a single change). At a steady speed v that leaves an error in proportion to v^2, and not to v times how
// far away the tangent was made: one iteration a frame instead of two where patches are pushed half as deep as an edge
// is long and 10 edges/s fast.
#pragma once

#include "runtime/src/zone/zone_balance.hpp"

namespace palpate {

// How often a step is halved until it leaves all elements upright.
inline constexpr uint32_t kMostCuts = 6;

// The patches of the group's contacts as they are to be: u = d + (R - 1) r, r the arm at rest.
void place_held(ZoneFrame& frame, const ZoneGroup& group);

// Of an axis, what stands for the length that it moves the tissue by.
double length_of(const ZoneFrame& frame, uint32_t axis, double change);

// Of the group's axes, by how much they change from one place to another: displacements, and the spins of patches.
// Places are by axis of the set.
void find_change(const ZoneSet& set, const ZoneGroup& group, const double* from, const double* to,
                 double* change);

// Adds factor times [unknowns] to their displacements.
void add_to_unknowns(const ZoneFrame& frame, const ZoneGroup& group, const double* change, double factor);

// Where the nodes of the group are, to return to.
void save_group(const ZoneFrame& frame, const ZoneGroup& group);
void restore_group(ZoneFrame& frame, const ZoneGroup& group);

// The group has moved by so much: its tangents are that much older, and the others do not know of it.
void count_move(ZoneFrame& frame, ZoneGroup& group, double length);

// Takes the contacts towards where they are to be, to ZoneGroup::longest_step from where the group was in balance last and
// as far as all elements stay upright, and the rest along. Points that patches turn about go on from where they are.
void move_contacts(ZoneFrame& frame, ZoneGroup& group, const double* wanted);

// How far unknowns and axes have gone since move_contacts(), for the next one, if it is the axes that have moved them.
void keep_trend(const ZoneFrame& frame, ZoneGroup& group);

}  // namespace palpate
