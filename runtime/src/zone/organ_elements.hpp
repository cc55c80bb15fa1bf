// All elements of the organ in batches, front by front (Organ in schemas/pack.fbs).
#pragma once

#include "runtime/src/base/arena.hpp"
#include "runtime/src/zone/zone_elements.hpp"

namespace palpate {

struct OrganElements {
  ZoneBatches all;            // the nodes of batches are those of OrganView
  uint32_t* first_linear;     // [num_fronts + 1] the first batch of each front in all.linear
  uint32_t* first_quadratic;  // [num_fronts + 1] and in all.quadratic
  uint32_t* first_patch;      // [num_fronts + 1] and its first volume patch
};

void carve_organ_elements(const pal_pack& pack, Arena& arena, OrganElements& elements);

// Computes the shapes of all elements. Returns false if an element is inverted in the mesh.
bool fill_organ_elements(const pal_pack& pack, OrganElements& elements);

// The batches of one front.
ZoneBatches batches_of_front(const OrganElements& elements, uint32_t front);

}  // namespace palpate
