// Volume measures and pressures of volume patches (ZonePatch in zone_elements.hpp has the equations).
#pragma once

#include "runtime/src/elements/element_scatter.hpp"

namespace palpate {

// Computes the measure, pressure and stiffness of each patch. Returns the energy sum of V U(theta).
double share_volumes(const ZoneBatches& batches, const double* displacement);

// Adds U'' / V  G G^T of each patch, with the stiffness of the last share_volumes().
void add_dyads(const ZoneBatches& batches, const double* displacement, const ZoneUnknowns& unknowns,
               const Target& target);

}  // namespace palpate
