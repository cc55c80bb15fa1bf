// Patches that turn with what holds them, which nonlinear_zone alone answers: its elements need no samples for it.
//
// Held at a point p, a node of the patch at the arm r from there moves by d + (R - 1) r; a force f on it is the
// torque (R r) x f about where p has moved to. R goes with the contact as its *turn*, twice the vector part of its
// unit quaternion, whose scalar part is not negative: for small ones the rotation vector, at a quarter turn of length
// sqrt(2), which is the most that a zone is asked for.
#pragma once

#include <palpate/palpate.h>

namespace palpate {

struct HeldContact;

// Whether patches of the session turn.
bool has_turns(const pal_session& session);

// Takes the turns [count][3] of contacts that a zone is to answer, null: none, behind their displacements, and where
// their places are. What is beyond a quarter turn is shortened, and flagged. Whether any is turned.
bool take_turns(pal_session& session, const pal_contact* contacts, uint32_t count, const double* turns);

// How a tool that stands like this turns what it holds, in the organ frame. Beyond a quarter turn it slips: where it
// took hold turns along, so that what it feels does not jump as it goes round.
void find_turn(const pal_session& session, const double orientation[4], HeldContact& contact, double turn[3]);

// Of what two contacts (`row` and `column` of those answered), turned by these, bring with them, all that goes with
// turns of the row: passivity.cpp has the sum.
double energy_of_turns(const pal_session& session, uint32_t row, uint32_t column, const pal_contact& of_row,
                       const double* row_turn, const pal_contact& of_column, const double* column_turn);

}  // namespace palpate
