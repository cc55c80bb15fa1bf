// Patches that turn with what holds them, which nonlinear_zone alone answers: its elements need no samples for it.
//
// Held at a point p, a node of the patch at the arm r from there moves by d + (R - 1) r; a force f on it is the
// torque (R r) x f about where p has moved to. R goes with the contact as its *turn*, twice the vector part of its
// unit quaternion, whose scalar part is not negative: for small ones the rotation vector, at a quarter turn of length
// sqrt(2), which is the most that a zone is asked for.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/response/tissue_state.hpp"

namespace palpate {

// Whether patches of the session turn.
bool has_turns(const TissueState& tissue);

// Takes the turns [count][3] of contacts that a zone is to answer, null: none, behind their displacements, and where
// their places are. What is beyond a quarter turn is shortened, and flagged. Whether any is turned.
bool take_turns(TissueState& tissue, const pal_contact* contacts, uint32_t count, const double* turns);

// Shortens a turn to a quarter turn. True where it was longer.
bool shorten_turn(double turn[3]);

// Of what two contacts (`row` and `column` of those answered), turned by these, bring with them, all that goes with
// turns of the row: passivity.cpp has the sum.
double energy_of_turns(const TissueState& tissue, uint32_t row, uint32_t column, const pal_contact& of_row,
                       const double* row_turn, const pal_contact& of_column, const double* column_turn);

}  // namespace palpate
