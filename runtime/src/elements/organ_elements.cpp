#include "runtime/src/elements/organ_elements.hpp"

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

// Numbers of elements or batches by kind, and of volume patches.
struct FrontCounts {
  uint32_t linear;
  uint32_t quadratic;
  uint32_t patches;
};

FrontCounts count_elements(const OrganView& organ, const pack::Front& front) {
  FrontCounts counts = {};
  uint32_t last_patch = pack::kNoPatch;
  for (uint32_t e = front.first_element; e < front.first_element + front.num_elements; ++e) {
    const pack::OrganElement& element = organ.elements[e];
    ++(element.num_nodes == 4 ? counts.linear : counts.quadratic);
    if (element.volume_patch != pack::kNoPatch && element.volume_patch != last_patch) ++counts.patches;
    last_patch = element.volume_patch;
  }
  return counts;
}

uint32_t num_batches(uint32_t elements) {
  return (elements + kLanes - 1) / kLanes;
}

// Counts the batches of all fronts. No batch holds elements of two fronts.
FrontCounts count_batches(const OrganView& organ) {
  FrontCounts batches = {};
  for (uint32_t f = 0; f < organ.num_fronts; ++f) {
    const FrontCounts counts = count_elements(organ, organ.fronts[f]);
    batches.linear += num_batches(counts.linear);
    batches.quadratic += num_batches(counts.quadratic);
  }
  return batches;
}

}  // namespace

void carve_organ_elements(const pal_pack& pack, Arena& arena, OrganElements& elements) {
  const OrganView& organ = pack.organ;
  const FrontCounts batches = count_batches(organ);
  elements = {};
  elements.all.linear = arena.take<ZoneBatch<4>>(batches.linear);
  elements.all.quadratic = arena.take<ZoneBatch<10>>(batches.quadratic);
  elements.all.patches = arena.take<ZonePatch>(organ.num_patches);
  elements.first_linear = arena.take<uint32_t>(organ.num_fronts + size_t{1});
  elements.first_quadratic = arena.take<uint32_t>(organ.num_fronts + size_t{1});
  elements.first_patch = arena.take<uint32_t>(organ.num_fronts + size_t{1});
}

bool fill_organ_elements(const pal_pack& pack, OrganElements& elements) {
  const OrganView& organ = pack.organ;
  ZoneBatches& all = elements.all;
  all.num_linear = all.num_quadratic = 0;
  all.num_patches = organ.num_patches;
  for (uint32_t p = 0; p < organ.num_patches; ++p) all.patches[p] = {};
  uint32_t patches = 0;
  for (uint32_t f = 0; f < organ.num_fronts; ++f) {
    const pack::Front& front = organ.fronts[f];
    elements.first_linear[f] = all.num_linear;
    elements.first_quadratic[f] = all.num_quadratic;
    elements.first_patch[f] = patches;
    uint32_t linear = 0;
    uint32_t quadratic = 0;
    for (uint32_t e = front.first_element; e < front.first_element + front.num_elements; ++e) {
      const pack::OrganElement& element = organ.elements[e];
      const uint32_t patch = element.volume_patch;
      const bool is_shaped = element.num_nodes == 4
                                 ? append_element(pack, element, nullptr, patch, linear++, all.patches,
                                                  all.linear + all.num_linear)
                                 : append_element(pack, element, nullptr, patch, quadratic++, all.patches,
                                                  all.quadratic + all.num_quadratic);
      if (!is_shaped) return false;
    }
    all.num_linear += num_batches(linear);
    all.num_quadratic += num_batches(quadratic);
    patches += count_elements(organ, front).patches;
  }
  elements.first_linear[organ.num_fronts] = all.num_linear;
  elements.first_quadratic[organ.num_fronts] = all.num_quadratic;
  elements.first_patch[organ.num_fronts] = patches;
  return true;
}

uint32_t most_simd_lanes(const pal_pack& pack) {
  const FrontCounts batches = count_batches(pack.organ);
  return kLanes * (batches.linear + batches.quadratic);
}

void list_zones(const OrganView& organ, const OrganElements& elements, const uint8_t* zone_of_element,
                uint8_t* zone_of_simd_lane) {
  for (uint32_t f = 0; f < organ.num_fronts; ++f) {
    const pack::Front& front = organ.fronts[f];
    uint8_t* linear = zone_of_simd_lane + kLanes * elements.first_linear[f];
    uint8_t* quadratic = zone_of_simd_lane + kLanes * (elements.all.num_linear + elements.first_quadratic[f]);
    for (uint32_t e = front.first_element; e < front.first_element + front.num_elements; ++e)
      *(organ.elements[e].num_nodes == 4 ? linear++ : quadratic++) = zone_of_element[e];
  }
}

ZoneBatches batches_of_front(const OrganElements& elements, const uint8_t* zone_of_simd_lane, uint8_t zone,
                             uint32_t front) {
  ZoneBatches batches = elements.all;
  batches.linear += elements.first_linear[front];
  batches.num_linear = elements.first_linear[front + 1] - elements.first_linear[front];
  batches.quadratic += elements.first_quadratic[front];
  batches.num_quadratic = elements.first_quadratic[front + 1] - elements.first_quadratic[front];
  batches.first_patch = elements.first_patch[front];
  batches.num_patches = elements.first_patch[front + 1] - elements.first_patch[front];
  if (zone_of_simd_lane == nullptr) return batches;
  batches.kept_linear.of_lane = zone_of_simd_lane + kLanes * elements.first_linear[front];
  batches.kept_quadratic.of_lane =
      zone_of_simd_lane + kLanes * (elements.all.num_linear + elements.first_quadratic[front]);
  batches.kept_linear.number = batches.kept_quadratic.number = zone;
  return batches;
}

}  // namespace palpate
