// Makes the tangents of a set's groups in the refining lane, from the lane's elements and condensation.
#pragma once

#include "runtime/src/refining/zone_layout.hpp"
#include "runtime/src/zone/tangent_maker.hpp"
#include "runtime/src/zone/zone_tangent.hpp"

namespace palpate {

struct GroupTangents {
  uint32_t group;      // index of the group at work
  TangentMaker maker;  // progress of the group's tangent
};

// Input of the tangents.
struct GroupTangentSource {
  const pal_pack& pack;
  const EliminationKernel& kernel;
  const OrganElements& elements;
  const ZoneLayout& layout;
  const float* blocks;         // S of all groups (exterior_size())
  const double* displacement;  // [num_nodes of the organ][3] from the mesh
  const ZoneMaster* masters;   // of the set's held nodes, with the arms at `displacement`
};

// Advances until `spent` reaches `operations`, multiply-adds. Returns true once `made` [num_groups] is full.
bool advance_group_tangents(const GroupTangentSource& source, uint64_t operations,
                            const TangentBuffers& buffers, Tangent* made, GroupTangents& tangents,
                            uint64_t& spent);

}  // namespace palpate
