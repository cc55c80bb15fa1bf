// How the refining lane prepares a set of contacts while frames go on with the set before (refinement.hpp):
//
//   name       a frame names the contacts and the fixed nodes              (state_transfer.hpp)
//   members    nodes and elements of its groups                            (zone_members.hpp)
//   rest       nodal forces at rest
//   place      nodes start where the organ has got to                      (state_transfer.hpp)
//   S          the lane condenses the exterior                             (condensation.hpp)
//   tangents   the first tangent of each group                             (group_tangents.hpp)
//
// The next frame exchanges the set for its own. Work is counted in multiply-adds as fast as elimination makes them, so that
// the same slices do the same on any processor.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

// A bit for each contact of a set.
using ContactBits = uint8_t;
static_assert(kMostZoneContacts <= 8 * sizeof(ContactBits));

struct ZonePreparation {
  ZoneRoom room;
  ZoneSet set;
  ZoneWork work;
  // Progress
  uint32_t group;
  uint32_t column;  // step of the members or of the forces
  struct Used {     // entries of the set's arrays
    uint32_t masters;
    uint32_t linear;
    uint32_t quadratic;
    uint32_t patches;
    uint32_t boundary;
    size_t rows;
    size_t tangents;
    size_t tangent_rows;
  } used;
  // The contacts whose zones hold a node or an element of the organ
  ContactBits* node_contacts;     // [num_nodes of the organ]
  ContactBits* element_contacts;  // [elements of the organ]
  uint32_t* found_nodes;          // [ZoneRoom::nodes]
  uint32_t* found_elements;       // [ZoneRoom::elements]
  uint32_t num_found_nodes;
  uint32_t num_found_elements;
  uint32_t* queue;  // [ZoneRoom::nodes]
  // Of the set that was listed last
  uint32_t* place_of;        // [num_nodes of the organ] the place of each of its nodes in ZoneSet::nodes
  uint8_t* zone_of_element;  // [elements of the organ] 1 + the number of the group; 0: the exterior
};

void carve_preparation(const pal_pack& pack, const ZoneRoom& room, Arena& arena,
                       ZonePreparation& preparation);

// Begins `rest`, after the members. Returns false, and refuses the set, where it is more than the room.
bool begin_rest(ZonePreparation& preparation);

// Advances `rest` for about so many multiply-adds in all. Returns true once it has ended.
bool advance_rest(const pal_pack& pack, uint64_t operations, ZonePreparation& preparation, uint64_t& spent);

// The set answers nothing.
void refuse_set(ZonePreparation& preparation);

}  // namespace palpate
