// The linearisation of a group (tangent_maker.hpp) in the frames that use it.
//
// The refining lane makes the tangent of each group where the zone of a request is, and hands it over with the delivery
// (group_tangents.hpp). Frames keep it until the next delivery: a modified Newton method. A step leaves of an error the
// part by which the stiffness has changed since. A frame makes a tangent itself only where there is none, where that part
// is too large, or where no delivery has come for PAL_ZONE_STIFFNESS_FRAMES frames.
//
// r_c - X L^-1 r_u is the force on a contact once u is corrected to first order. ZoneSet::turning is the part of
// d torque / dw by which the nodes' forces act on arms that turn.
#pragma once

#include "runtime/src/zone/zone_balance.hpp"

namespace palpate {

// What became of the tangent of a group.
enum class Tangent : uint8_t { none, sound, shifted };

// At the displacements that the group has. Returns false where the stiffness is not positive definite even with a raised
// diagonal: the group then has no tangent. Cost: m^3 / 6 multiply-adds, m = 3 x nodes, and the stiffness of its elements.
bool make_tangent(ZoneFrame& frame, ZoneGroup& group);

// Points each group at its tangent. `made`: [num_groups].
void use_tangents(const TangentBuffers& buffers, const Tangent* made, ZoneSet& set);

// A zone that has moved less since the state of its tangent, of the scene's largest displacement, is still there.
inline constexpr double kSamePlace = 1e-6;

// Counts a solve.
void count_solve(const ZoneFrame& frame, ZoneGroup& group);

// Whether the zone has moved far since the tangent, or has moved and the lane has not handed over another one for long.
bool is_outdated(const ZoneFrame& frame, const ZoneGroup& group);

// The stiffness changes by this part where a zone moves by one mean surface edge: elements at a patch are strained by 1.
inline constexpr double kStiffening = 2;

// Of an error, the part that a step leaves: what is expected of how far the tangent's place is, or what the last step
// has left of the residual, if that is more. 0 .. 1.
double contraction(const ZoneFrame& frame, const ZoneGroup& group);

// Newton's step K_uu^-1 r_u, [unknowns], of find_residual() before.
const double* find_step(ZoneFrame& frame, const ZoneGroup& group);

// d unknown / d axis, negative: [unknowns], of the group's axis `index`.
const double* sensitivity(const ZoneGroup& group, uint32_t index);

// Forces and torques of the contacts, of find_residual() before, into the set. They stay as they were where they would
// not be finite.
void find_forces(ZoneFrame& frame, const ZoneGroup& group);

}  // namespace palpate
