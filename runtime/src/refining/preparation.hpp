// The refining lane prepares a set of contacts while frames go on with the active set (refinement.hpp):
//
//   name       a frame names the contacts and the fixed nodes              (state_transfer.hpp)
//   members    the lane lists nodes and elements of the groups             (zone_members.hpp)
//   place      starts the nodes from the current solution                  (state_transfer.hpp)
//   S          condenses the exterior onto the boundaries                  (condensation.hpp)
//   tangents   makes the first tangent of each group                       (group_tangents.hpp)
//   respond    finds how the field follows the contacts                    (field_response.hpp)
//
// The next frame exchanges the active set for the prepared set. Work is counted in multiply-adds of the
// elimination, so that a slice ends at the same place on any processor.
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
  uint32_t step;  // members: number of steps done
  struct Used {   // entries of the set's arrays that earlier groups use
    uint32_t masters;
    uint32_t linear;
    uint32_t quadratic;
    uint32_t patches;
    uint32_t boundary;
    size_t rows;
    size_t tangents;
    size_t tangent_rows;
  } used;
  // Marks while the members are listed
  ContactBits* node_contacts;     // [num_nodes of the organ] contacts whose zones hold the node
  ContactBits* element_contacts;  // [elements of the organ] contacts whose zones hold the element
  uint32_t* found_nodes;          // [ZoneRoom::nodes] nodes with a bit
  uint32_t* found_elements;       // [ZoneRoom::elements] elements with a bit
  uint32_t num_found_nodes;
  uint32_t num_found_elements;
  uint32_t* queue;  // [ZoneRoom::nodes] scratch: nodes of a zone, ring by ring; roles of nodes
  // Members of the set that was listed last
  uint32_t* place_of;         // [num_nodes of the organ] place in ZoneSet::nodes; undefined for other nodes
  uint8_t* group_of_element;  // [elements of the organ] 1 + the number of the group; 0: the exterior
};

void carve_preparation(const pal_pack& pack, const ZoneRoom& room, Arena& arena,
                       ZonePreparation& preparation);

// Empties the set and marks it as unsound, so that the set cannot answer.
void refuse_set(ZonePreparation& preparation);

}  // namespace palpate
