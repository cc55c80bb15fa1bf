// Opening refuses packs whose organ table contradicts itself.
#include <gtest/gtest.h>

#include <functional>
#include <stdexcept>

#include "tests/support/mutated_pack_fixture.hpp"

namespace palpate::test::mutated_pack_fixture {
namespace contradicting_organ_test {

// Pointers into a copy of the pack.
struct OrganArrays {
  explicit OrganArrays(AlignedBytes& copy) {
    unsigned char* bytes = copy.bytes().data();
    const pack::Organ& organ = *pack::GetPack(bytes + sizeof(pack::PackHeader))->organ();
    nodes = reinterpret_cast<pack::OrganNode*>(bytes + organ.nodes()->offset());
    elements = reinterpret_cast<pack::OrganElement*>(bytes + organ.elements()->offset());
    node_elements = reinterpret_cast<uint32_t*>(bytes + organ.node_elements()->offset());
    fronts = reinterpret_cast<pack::Front*>(bytes + organ.fronts()->offset());
    order = reinterpret_cast<uint32_t*>(bytes + organ.order()->offset());
    rows = reinterpret_cast<uint32_t*>(bytes + organ.rows()->offset());
    num_nodes = organ.num_nodes();
    num_free = organ.num_free();
    num_elements = organ.num_elements();
    num_fronts = organ.num_fronts();
  }
  pack::OrganNode* nodes;
  pack::OrganElement* elements;
  uint32_t* node_elements;
  pack::Front* fronts;
  uint32_t* order;
  uint32_t* rows;
  uint32_t num_nodes, num_free, num_elements, num_fronts;
};

pal_status status_after(const std::function<void(OrganArrays&)>& change) {
  AlignedBytes copy = copy_of(zone_pack_bytes().bytes());
  OrganArrays arrays(copy);
  change(arrays);
  repair_checksum(copy.bytes());
  return open_status(copy.bytes());
}

TEST_F(Contradiction, OrganAsWritten) {
  EXPECT_EQ(status_after([](OrganArrays&) {}), PAL_STATUS_OK);
}

TEST_F(Contradiction, NodesOfTheOrgan) {
  const std::function<void(OrganArrays&)> changes[] = {
      [](OrganArrays& organ) { organ.nodes[0].packed_node += 1; },
      [](OrganArrays& organ) { organ.nodes[organ.num_nodes - 1].packed_node = 1u << 30; },
      [](OrganArrays& organ) { organ.nodes[0].free_axes = 0; },
      [](OrganArrays& organ) { organ.nodes[0].free_axes = 8; },
      [](OrganArrays& organ) { organ.nodes[organ.num_nodes - 1].free_axes = 1; },
      [](OrganArrays& organ) { organ.nodes[1].first_element += 1; },
      [](OrganArrays& organ) { organ.nodes[organ.num_nodes - 1].num_elements += 1; },
      [](OrganArrays& organ) { organ.nodes[2].position[1] = 1e300; },
      [](OrganArrays& organ) { organ.nodes[2].displacement[0] = std::nan(""); },
      [](OrganArrays& organ) { organ.node_elements[0] = organ.num_elements; },
      [](OrganArrays& organ) { organ.node_elements[1] = organ.node_elements[0]; },
      [](OrganArrays& organ) { std::swap(organ.node_elements[0], organ.node_elements[1]); },
      [](OrganArrays& organ) { organ.elements[0].nodes[0] = organ.num_nodes; },
      [](OrganArrays& organ) { organ.elements[0].nodes[0] = organ.elements[0].nodes[1]; },
      [](OrganArrays& organ) { organ.elements[0].num_nodes = 5; },
      [](OrganArrays& organ) { organ.elements[0].material = 1000; },
      [](OrganArrays& organ) {  // a list without its last element
        uint32_t last = organ.num_nodes - 1;
        while (organ.nodes[last].num_elements == 0) --last;
        --organ.nodes[last].num_elements;
      },
  };
  for (size_t i = 0; i < std::size(changes); ++i)
    EXPECT_EQ(status_after(changes[i]), PAL_STATUS_CORRUPT_CONTENT) << i;
}

// The first element of a front behind the first one, with three elements or more.
uint32_t first_of_three(const OrganArrays& organ) {
  for (const pack::Front* front = organ.fronts; front < organ.fronts + organ.num_fronts; ++front) {
    if (front->num_elements >= 3 && front->first_element > 0) return front->first_element;
  }
  throw std::logic_error("no such front");
}

TEST_F(Contradiction, VolumePatchesOfTheOrgan) {
  EXPECT_EQ(status_after([](OrganArrays& organ) {
              pack::OrganElement* element = organ.elements + first_of_three(organ);
              element[0].volume_patch = element[1].volume_patch = 0;
            }),
            PAL_STATUS_OK);
  const std::function<void(OrganArrays&)> changes[] = {
      [](OrganArrays& organ) { organ.elements[0].volume_patch = 1; },  // not numbered from 0
      [](OrganArrays& organ) {                                         // not consecutive
        pack::OrganElement* element = organ.elements + first_of_three(organ);
        element[0].volume_patch = element[2].volume_patch = 0;
      },
      [](OrganArrays& organ) {  // in two fronts
        pack::OrganElement* element = organ.elements + first_of_three(organ);
        element[-1].volume_patch = element[0].volume_patch = 0;
      },
      [](OrganArrays& organ) {  // beyond a frame's capacity
        for (uint32_t i = 0; i <= pack::kMostPatchNodes / 4; ++i) organ.elements[i].volume_patch = 0;
      },
  };
  for (size_t i = 0; i < std::size(changes); ++i)
    EXPECT_EQ(status_after(changes[i]), PAL_STATUS_CORRUPT_CONTENT) << i;
}

TEST_F(Contradiction, TreeOfTheOrgan) {
  const std::function<void(OrganArrays&)> changes[] = {
      [](OrganArrays& organ) { organ.order[0] = organ.num_free; },
      [](OrganArrays& organ) { organ.fronts[0].num_columns += 1; },
      [](OrganArrays& organ) { organ.fronts[0].num_columns = 0; },
      [](OrganArrays& organ) { organ.fronts[0].num_rows += 1; },
      [](OrganArrays& organ) { organ.fronts[0].num_elements += 1; },
      [](OrganArrays& organ) { organ.fronts[0].parent = 0; },
      [](OrganArrays& organ) { organ.fronts[0].parent = organ.num_fronts; },
      [](OrganArrays& organ) { organ.fronts[0].parent = pack::kNoFront; },
      [](OrganArrays& organ) { organ.fronts[0].num_within = 2; },
      [](OrganArrays& organ) { organ.fronts[organ.num_fronts - 1].num_within -= 1; },
      [](OrganArrays& organ) { organ.rows[0] = organ.fronts[0].first_column; },
      [](OrganArrays& organ) { organ.rows[0] = organ.num_free; },
      [](OrganArrays& organ) { std::swap(organ.rows[0], organ.rows[1]); },
  };
  for (size_t i = 0; i < std::size(changes); ++i)
    EXPECT_EQ(status_after(changes[i]), PAL_STATUS_CORRUPT_CONTENT) << i;
}

}  // namespace contradicting_organ_test
}  // namespace palpate::test::mutated_pack_fixture
