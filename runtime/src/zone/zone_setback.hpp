// What becomes of a group where Newton does not lead to the balance that its contacts lead to: when it goes back, and where
// to.
#pragma once

#include "runtime/src/zone/zone_balance.hpp"

namespace palpate {

enum class Setback { none, to_balance, to_rest };

// After a solve, which it counts. `wanted`: where the contacts are to be, by axis; `size`: the largest displacement of a
// contact, length unit; `failed`: there was no way on; `done`: the group is in balance.
Setback find_setback(const ZoneFrame& frame, const double* wanted, double size, bool failed, bool done,
                     ZoneGroup& group);

// Not Setback::none. From its last balance the contacts follow in shorter steps, or anew from rest.
void go_back(ZoneFrame& frame, Setback setback, ZoneGroup& group);

}  // namespace palpate
