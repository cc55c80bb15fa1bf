// State transfer: a new set of contacts starts from the current solution.
//
// Nodes in both sets keep their displacement. Other nodes take the displacement of the refining lane's
// exterior. A patch takes the mean displacement of its nodes. A contact that stays at its site keeps its
// force and rotation. A contact that slides to a neighbouring site keeps its rotation.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/refining/preparation.hpp"
#include "runtime/src/zone/zone_mailbox.hpp"

namespace palpate {

// Names the set to prepare: 1 .. ZoneRoom::contacts contacts and at most ZoneRoom::fixed nodes. A frame calls
// this function before request_set(). `before`: the active set.
void name_contacts(const pal_pack& pack, const pal_contact* contacts, uint32_t count, const FixedNodes& fixed,
                   const ZoneSet& before, ZonePreparation& preparation);

// Places the set's nodes at the organ's displacement[num_nodes][3], from the mesh. The refining lane calls
// this function. A group with an inverted element goes to rest, and the result is false.
bool place_set(const pal_pack& pack, const double* displacement, ZonePreparation& preparation);

// Exchanges the active set for the prepared set. A frame calls this function after take_prepared().
void exchange_sets(const pal_pack& pack, ZoneMailbox& mailbox, ZonePreparation& preparation,
                   ZoneState& state);

}  // namespace palpate
