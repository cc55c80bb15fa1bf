// Patches that rotate with their tools. Only nonlinear_zone answers rotations, because its elements need no
// samples.
//
// With the contact at p, a patch node at the arm r moves by d + (R - 1) r. A force f on this node has the
// torque (R r) x f about the moved p. The contact stores R as its *turn*: twice the vector part of the unit
// quaternion of R with non-negative scalar part. A small turn equals the rotation vector. A quarter turn has
// the length sqrt(2), which is the limit for a zone.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/response/tissue_state.hpp"

namespace palpate {

// Whether patches of the session rotate.
bool has_turns(const TissueState& tissue);

// Stores contacts' turns [count][3] behind their displacements, and finds their places. Null turns mean no
// rotation. The function shortens and flags rotations beyond a quarter turn. Returns whether any contact is
// rotated.
bool take_turns(TissueState& tissue, const pal_contact* contacts, uint32_t count, const double* turns);

// Shortens a turn to a quarter turn. Returns whether it shortened the turn.
bool shorten_turn(double turn[3]);

}  // namespace palpate
