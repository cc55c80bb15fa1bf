// From one set of contacts to the next: the new set starts where the organ has got to.
//
// Nodes of both sets keep their displacement. Other nodes take that of the refining lane's last field. A patch is where its
// nodes are in the mean. A contact that stays keeps its force and its rotation; one that slides to the next site keeps
// its rotation.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/refining/preparation.hpp"
#include "runtime/src/zone/zone_mailbox.hpp"

namespace palpate {

// The frame's part before a request: names 1 .. ZoneRoom::contacts contacts and at most ZoneRoom::fixed nodes. `before`: the
// set that answers.
void name_contacts(const pal_pack& pack, const pal_contact* contacts, uint32_t count, const FixedNodes& fixed,
                   const ZoneSet& before, ZonePreparation& preparation);

// The lane's part: places nodes by the organ's displacement[num_nodes][3] from the mesh. Returns false where an element would
// be inverted: its group is at rest then.
bool place_set(const pal_pack& pack, const double* displacement, ZonePreparation& preparation);

// The frame's part after the delivery: exchanges the prepared set for the active one.
void exchange_sets(const pal_pack& pack, ZoneMailbox& mailbox, ZonePreparation& preparation,
                   ZoneState& state);

}  // namespace palpate
