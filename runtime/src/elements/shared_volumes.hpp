// The volumes and pressures that elements of a volume patch share (ZonePatch has the equations).
#pragma once

#include "runtime/src/elements/element_scatter.hpp"

namespace palpate {

// Finds the patches' measures, pressures and their derivatives. Returns their energy.
double share_volumes(const ZoneBatches& batches, const double* displacement);

// Adds U'' / V  G G^T of each patch, after share_volumes().
void add_dyads(const ZoneBatches& batches, const double* displacement, const ZoneUnknowns& unknowns,
               const Target& target);

}  // namespace palpate
