// All elements of the organ in batches, front by front (Organ in schemas/pack.fbs).
#pragma once

#include "runtime/src/base/arena.hpp"
#include "runtime/src/elements/zone_elements.hpp"

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

// At least as many as all batches have lanes. The linear ones come first.
uint32_t most_lanes(const pal_pack& pack);

// Lists the number of the zone that holds each element, by lanes: 0 is the exterior. zone_of_lane: [most_lanes()].
void list_zones(const OrganView& organ, const OrganElements& elements, const uint8_t* zone_of_element,
                uint8_t* zone_of_lane);

// The batches of one front, with the elements of one zone. `zone_of_lane`: [most_lanes()], or null for all elements.
ZoneBatches batches_of_front(const OrganElements& elements, const uint8_t* zone_of_lane, uint8_t zone,
                             uint32_t front);

}  // namespace palpate
