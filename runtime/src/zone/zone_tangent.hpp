// The linearisation of a group: its stiffness factored, and what it says of the contacts.
//
// A patch moves as one, so a contact is three unknowns, or six where patches turn: dw moves a node by dw x a, a its arm.
// The contacts c stand behind the unknowns u of interior and boundary:
//
//   [ K_uu   .   ]        [ L         .       ]
//   [ K_cu  K_cc ]  ->    [ X   K_cc - X X^T  ]    after elimination of u
//
// A = K_cc - X X^T is the stiffness that a tool feels, and -X L^-1 how u follows the contacts, which is where the next
// frame starts from. r_c - X L^-1 r_u is the force once u is set right to first order. What the nodes' own forces add to
// d torque / dw as their arms turn is ZoneSet::turning.
//
// A tangent is kept from frame to frame (a modified Newton method): a step of it leaves of an error the part by which
// the stiffness has changed since, where a tool moves by some hundredths of an edge in a frame. Meanwhile the next
// one is made in slices, within kTangentFrames frames, so that no frame pays for all of it, of elements as they are
// when their turn comes (all in one frame where they share volumes); in one go where there is none, or where that part
// is too large.
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

// Goes on with the first tangent of a group, where its nodes are placed, for about so many multiply-adds in all. True once
// it is there, or none is to be had there.
bool advance_first_tangent(ZoneFrame& frame, uint64_t operations, ZoneGroup& group, uint64_t& spent);

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
