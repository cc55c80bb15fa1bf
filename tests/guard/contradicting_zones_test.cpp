// Opening refuses packs whose zone tables contradict one another.
#include <gtest/gtest.h>

#include "tests/support/mutated_pack_fixture.hpp"

namespace palpate::test::mutated_pack_fixture {
namespace contradicting_zones_test {

TEST_F(Contradiction, Zones) {
  const AlignedBytes& original = zone_pack_bytes();
  const pack::NonlinearZone& zone =
      *pack::GetPack(original.bytes().data() + sizeof(pack::PackHeader))->nonlinear_zone();
  const uint32_t last = zone.num_nodes() - 1;
  const auto with_node = [&](auto&& change) {
    return status_with<pack::ZoneNode>(zone.nodes(), change, original);
  };
  const auto with_element = [&](auto&& change) {
    return status_with<pack::ZoneElement>(zone.elements(), change, original);
  };
  EXPECT_EQ(with_node([](pack::ZoneNode*) {}), PAL_STATUS_OK);
  EXPECT_EQ(with_node([](pack::ZoneNode* n) { n[1].packed_node = n[0].packed_node; }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(with_node([&](pack::ZoneNode* n) { n[last].packed_node = 1u << 30; }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(with_node([](pack::ZoneNode* n) { n[2].free_axes = 0; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(with_node([](pack::ZoneNode* n) { n[3].position[1] = std::nan(""); }),
            PAL_STATUS_CORRUPT_CONTENT);
  // A node's elements: each of its elements once, nodes in order.
  EXPECT_EQ(with_node([](pack::ZoneNode* n) { ++n[0].num_elements; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(with_node([](pack::ZoneNode* n) { n[2].first_element = n[1].first_element; }),
            PAL_STATUS_CORRUPT_CONTENT);
  const auto with_list = [&](auto&& change) {
    return status_with<uint32_t>(zone.node_elements(), change, original);
  };
  EXPECT_EQ(with_list([](uint32_t* e) { std::swap(e[0], e[1]); }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(with_list([&](uint32_t* e) { e[0] = zone.num_elements(); }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(with_element([](pack::ZoneElement* e) { e[0].num_nodes = 5; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(with_element([](pack::ZoneElement* e) { e[0].nodes[1] = e[0].nodes[0]; }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(with_element([&](pack::ZoneElement* e) { e[1].nodes[2] = zone.num_nodes(); }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(with_element([](pack::ZoneElement* e) { e[1].material = 7; }), PAL_STATUS_CORRUPT_CONTENT);
  // Volume patches are consecutive and fit a frame's capacity.
  EXPECT_EQ(with_element([](pack::ZoneElement* e) { e[0].volume_patch = e[1].volume_patch = 3; }),
            PAL_STATUS_OK);
  EXPECT_EQ(with_element([](pack::ZoneElement* e) { e[1].volume_patch = 3; }), PAL_STATUS_CORRUPT_CONTENT);
  const uint32_t most = pack::kMostPatchNodes / 4;
  ASSERT_GT(zone.num_elements(), most);
  EXPECT_EQ(with_element([&](pack::ZoneElement* e) {
              for (uint32_t i = 0; i <= most; ++i) e[i].volume_patch = 3;
            }),
            PAL_STATUS_CORRUPT_CONTENT);
}

}  // namespace contradicting_zones_test
}  // namespace palpate::test::mutated_pack_fixture
