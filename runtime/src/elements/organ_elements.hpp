// All elements of the organ in batches, front by front (Organ in schemas/pack.fbs).
#pragma once

#include "runtime/src/base/arena.hpp"
#include "runtime/src/elements/zone_elements.hpp"

namespace palpate {

struct OrganElements {
  ZoneBatches all;            // nodes are numbered as in OrganView
  uint32_t* first_linear;     // [num_fronts + 1] the first batch of each front in all.linear
  uint32_t* first_quadratic;  // [num_fronts + 1] the first batch of each front in all.quadratic
  uint32_t* first_patch;      // [num_fronts + 1] the first volume patch of each front in all.patches
};

void carve_organ_elements(const pal_pack& pack, Arena& arena, OrganElements& elements);

// Computes the shapes of all elements. Returns false if an element is inverted in the mesh.
bool fill_organ_elements(const pal_pack& pack, OrganElements& elements);

// Returns the number of vector lanes of all batches, unused lanes included.
uint32_t most_simd_lanes(const pal_pack& pack);

// Lists each element's zone number; 0: the exterior. zone_of_simd_lane: [most_simd_lanes()], linear first.
void list_zones(const OrganView& organ, const OrganElements& elements, const uint8_t* zone_of_element,
                uint8_t* zone_of_simd_lane);

// Returns the batches of a front, with the elements of one zone; null zone_of_simd_lane: all elements.
ZoneBatches batches_of_front(const OrganElements& elements, const uint8_t* zone_of_simd_lane, uint8_t zone,
                             uint32_t front);

}  // namespace palpate
