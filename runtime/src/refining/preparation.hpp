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
  // [num_zone_nodes] and [num_zone_elements]: a bit for each contact whose zone holds it
  uint64_t* node_contacts;
  uint64_t* element_contacts;
  uint32_t* found_nodes;     // [ZoneRoom::nodes]
  uint32_t* found_elements;  // [ZoneRoom::elements]
  uint32_t num_found_nodes;
  uint32_t num_found_elements;
  uint32_t* queue;     // [ZoneRoom::nodes]
  uint32_t* place_of;  // [num_zone_nodes] place in a set's list + 1; 0: not in it
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
