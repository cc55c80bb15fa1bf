// The tangents of a set's groups, as the refining lane makes them: of the lane's own elements and condensation, at the
// displacements of a request. No frame is slowed by them.
#pragma once

#include "runtime/src/refining/zone_outline.hpp"
#include "runtime/src/zone/tangent_maker.hpp"
#include "runtime/src/zone/zone_tangent.hpp"

namespace palpate {

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
