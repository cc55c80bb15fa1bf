// The tangent of a group (tangent_maker.hpp) in the frames that use the tangent.
//
// The refining lane makes each group's tangent at the state of a request (group_tangents.hpp). Frames keep
// the tangent until the next delivery: a modified Newton method. A step multiplies an error by about the
// relative change of the stiffness since the tangent's state. A frame makes a tangent itself if the group
// has none, if a step reduces errors too little, or after PAL_ZONE_STIFFNESS_FRAMES frames.
//
// r: residual on unknowns u and contact axes c. A Newton step makes the contact forces r_c - X L^-1 r_u.
#pragma once

#include "runtime/src/zone/zone_balance.hpp"

namespace palpate {

// `shifted`: positive definite only with a raised diagonal.
enum class Tangent : uint8_t { none, sound, shifted };

// Makes the tangent at the group's displacements. Returns false if K_uu is not positive definite even with
// a raised diagonal. Cost: m^3 / 6 multiply-adds, m = 3 x nodes, and the elements' stiffness.
bool make_tangent(ZoneFrame& frame, ZoneGroup& group);

// Makes each group use its tangent in `buffers`, and its contacts' stiffness. `made`: [num_groups].
void use_tangents(const TangentBuffers& buffers, const Tangent* made, ZoneSet& set);

// A zone that has moved less is still at its tangent's state. Unit: the scene's largest displacement.
inline constexpr double kSamePlace = 1e-6;

// Counts a solve in ZoneTangent::age and age_since.
void count_solve(const ZoneFrame& frame, ZoneGroup& group);

// Whether the zone has moved far from the tangent's state, or left the state many solves ago.
bool is_outdated(const ZoneFrame& frame, const ZoneGroup& group);

// Relative change of the stiffness for a motion by a mean surface edge, which strains elements by about 1.
inline constexpr double kStiffening = 2;

// Returns the ratio of errors after and before a Newton step, 0 .. 1: the larger of an estimate from
// ZoneTangent::moved and ZoneTangent::residual_ratio.
double contraction(const ZoneFrame& frame, const ZoneGroup& group);

// Returns the Newton step K_uu^-1 r_u, [unknowns]. Call find_residual() first.
const double* find_step(ZoneFrame& frame, const ZoneGroup& group);

// Returns - d unknown / d axis, [unknowns], for the group's axis `index`.
const double* sensitivity(const ZoneGroup& group, uint32_t index);

// Writes the forces and torques of the contacts to ZoneSet::force if they are finite, after find_residual().
void find_forces(ZoneFrame& frame, const ZoneGroup& group);

}  // namespace palpate
