// The linearisation of a group: its stiffness factored, and what it says of the contacts.
//
// A patch moves as one, so contacts are three unknowns each, or six where patches turn: dw moves a node by dw x a, a
// its arm. Behind them stand, of contacts that share the zone, R = Gamma T, by which the boundary's moves make loads
// x (zone_exterior.hpp), three rows for each; and of all contacts -G^T, G = T dq/dx, and -Gamma G where the two meet:
//
//   [ K_uu   .    .   . ]        [ L    .                      . ]
//   [ K_cu  K_cc  .   . ]  ->    [ X   K_cc - X X^T    .       . ]    after elimination of the unknowns u
//   [ R      0    0   . ]        [ W   -W X^T             .    . ]
//   [ -G^T   0    H0  . ]        [ Z   -Z X^T    H0 - Z W^T    . ]        H0 = -(Gamma G)^T
//
// At given x, A = K_cc - X X^T is the stiffness that a tool feels and -X L^-1 how u follows the contacts, which is
// where the next frame starts from; r_c - X L^-1 r_u is the force once u is set right to first order. But then the
// loads are xi = Gamma t - W L^-1 r_u, and as they change to x + dx, u follows by Y dx, Y = K_uu^-1 G: dx = xi - x +
// (R Y - Gamma G) dx, so
//
//   dx = N (xi - x),   N = (1 - H)^-1,   H^T = H0 - Z W^T,   D^T = -Z X^T
//
// brings forces and torques D dx, and stiffness is A + D N (-W X^T). Of one contact 1 - H is inverted, and where the organ
// outside gives way D and H are left out and the answer flagged; of several N is a series in H, left out, with D, where
// the row sums of H are beyond 0.3. The load of a contact alone is its force, in
// units of force_scale: so much of the contact's own rows stands in the place of R, xi and H. What the nodes' own
// forces add to d torque / dw as their arms turn is ZoneSet::turning. What rims add is not in it: some 1e-3 of the stiffness
// of neighbours.
//
// A tangent is kept from frame to frame (a modified Newton method): a step of it leaves of an error the part by which
// the stiffness has changed since, where a tool moves by some hundredths of an edge in a frame. Meanwhile the next
// one is made in slices, within kTangentFrames frames, so that no frame pays for all of it, of elements as they are
// when their turn comes (all in one frame where they share volumes); in one go where there is none, or where that part
// is too large.
//
// The force is the gradient of the stored energy but for what q leaves out, orders beyond the third and what of the
// boundary's moves no loads make: the stiffness is nearly symmetric, and is made so.
#pragma once

#include "runtime/src/zone/zone_balance.hpp"

namespace palpate {

inline constexpr uint32_t kTangentFrames =
    PAL_ZONE_STIFFNESS_FRAMES / 2;  // one is used while the next is made

// At the displacements that the group has. False where the stiffness is not positive definite even
// when it is made stiffer: the group then has none. Cost: m^3 / 6 multiply-adds, m = 3 x nodes, and the stiffness of its
// elements.
bool make_tangent(ZoneFrame& frame, ZoneGroup& group);

// Goes on with the next one, if anything has moved since this one was begun.
void advance_tangent(ZoneFrame& frame, ZoneGroup& group);

// Goes on with the first tangent of a group of the next set, where that is placed, for about so many multiply-adds in
// all. True once it is there, or none is to be had there.
bool advance_first_tangent(const pal_pack& pack, uint64_t operations, ZoneState& state, ZoneGroup& group,
                           uint64_t& spent);

// Of an error, the part that a step leaves: what is expected of how far the tangent's place is, or what the last step
// has left of the residual, if that is more. 0 .. 1.
double contraction(const ZoneFrame& frame, const ZoneGroup& group);

// Newton's step K_uu^-1 r_u, [unknowns], of find_residual() before.
const double* find_step(ZoneFrame& frame, const ZoneGroup& group);

// d unknown / d axis, negative: [unknowns], of the group's axis `index`.
const double* sensitivity(const ZoneGroup& group, uint32_t index);

// Forces, torques and loads of the contacts of find_residual() and find_traction() before, into the set. They stay as
// they were where they would not be finite.
void find_forces(ZoneFrame& frame, const ZoneGroup& group);

}  // namespace palpate
