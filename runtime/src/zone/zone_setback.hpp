// A setback rejects a solve that fails or converges to a wrong equilibrium. The group returns to its balance,
// the last equilibrium, or to rest.
#pragma once

#include "runtime/src/zone/zone_balance.hpp"

namespace palpate {

enum class Setback { none, to_balance, to_rest };

// Judges a solve and updates ZoneGroup::setbacks. wanted[axes of the set]: goal of the contacts. `size`: the
// contacts' largest displacement, length unit. `failed`: Newton found no step. `done`: the solve converged.
Setback find_setback(const ZoneFrame& frame, const double* wanted, double size, bool failed, bool done,
                     ZoneGroup& group);

// Returns the group to its balance and shortens its steps, or returns the group to rest.
void go_back(ZoneFrame& frame, Setback setback, ZoneGroup& group);

}  // namespace palpate
