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

// The most that num_lanes() can be.
uint32_t most_lanes(const pal_pack& pack);

// Lanes of all batches: the linear ones first.
uint32_t num_lanes(const OrganElements& elements);

// Marks the lanes of the elements with is_zone_element[element] != 0. left_out: [num_lanes()].
void leave_out(const OrganView& organ, const OrganElements& elements, const uint8_t* is_zone_element,
               uint8_t* left_out);

// The batches of one front, but for the marked elements. `left_out`: [num_lanes()], or null.
ZoneBatches batches_of_front(const OrganElements& elements, const uint8_t* left_out, uint32_t front);

}  // namespace palpate
