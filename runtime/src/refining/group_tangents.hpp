// The tangents of a set's groups, as the refining lane makes them: of the lane's own elements and condensation, at the
// displacements of a request. No frame is slowed by them.
#pragma once

#include "runtime/src/elements/organ_elements.hpp"
#include "runtime/src/zone/tangent_maker.hpp"
#include "runtime/src/zone/zone_tangent.hpp"

namespace palpate {

// The set that the lane has prepared last, by the nodes of the organ.
struct ZoneOutline {
  uint64_t set;  // ZoneCorrection::number; 0: none
  uint32_t num_nodes;
  uint32_t* nodes;     // [ZoneRoom::nodes]
  uint32_t* place_of;  // [num_nodes of the organ] the place of a node in `nodes`
  uint32_t num_groups;
  GroupLayout groups[kMostZoneContacts];  // their boundaries are one after the other in Condensation::kept
  size_t exterior_size;
  uint8_t* zone_of_lane;  // [lanes] (organ_elements.hpp): 1 + the number of the group
  // Of the set, whose frames do not change them
  const uint32_t* unknown_of;
  const uint32_t* first_master;
};

struct GroupTangents {
  uint32_t group;
  TangentMaker maker;
};

// What the tangents are made from.
struct GroupTangentSource {
  const pal_pack& pack;
  const EliminationKernel& kernel;
  const OrganElements& elements;
  const ZoneOutline& outline;
  const float* blocks;         // S of all groups (exterior_size())
  const double* displacement;  // [num_nodes of the organ][3] from the mesh
  const ZoneMaster* masters;   // of the set, with the arms at these displacements
};

// Goes on for about so many multiply-adds in all. Returns true once all tangents are made or are not to be had.
bool advance_group_tangents(const GroupTangentSource& source, uint64_t operations,
                            const TangentBuffers& buffers, Tangent* made, GroupTangents& tangents,
                            uint64_t& spent);

}  // namespace palpate
