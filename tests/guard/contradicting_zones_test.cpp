// Opening refuses packs whose zones contradict the organ or themselves.
#include <gtest/gtest.h>

#include "tests/support/mutated_pack_fixture.hpp"

namespace palpate::test::mutated_pack_fixture {
namespace contradicting_zones_test {

using Zone = pack::NonlinearZone;

const pack::Pack& tables_with_zones() {
  return *pack::GetPack(zone_pack_bytes().bytes().data() + sizeof(pack::PackHeader));
}

TEST_F(Contradiction, SizesOfZones) {
  const Zone& zone = *tables_with_zones().nonlinear_zone();
  const pack::Organ& organ = *tables_with_zones().organ();
  const auto with = [](flatbuffers::voffset_t size, uint32_t value) {
    return status_with_scalar(pack::Pack::VT_NONLINEAR_ZONE, size, value, zone_pack_bytes());
  };
  EXPECT_EQ(with(Zone::VT_RINGS, pack::kMostZoneRings), PAL_STATUS_OK);
  EXPECT_EQ(with(Zone::VT_RINGS, 0), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(with(Zone::VT_RINGS, pack::kMostZoneRings + 1), PAL_STATUS_CORRUPT_CONTENT);
  // All zones together hold every contact node, and at most the organ.
  EXPECT_EQ(with(Zone::VT_NUM_NODES, organ.num_nodes()), PAL_STATUS_OK);
  EXPECT_EQ(with(Zone::VT_NUM_NODES, organ.num_nodes() + 1), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(with(Zone::VT_NUM_NODES, tables_with_zones().sites()->num_contact_nodes() - 1),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(with(Zone::VT_NUM_ELEMENTS, organ.num_elements()), PAL_STATUS_OK);
  EXPECT_EQ(with(Zone::VT_NUM_ELEMENTS, organ.num_elements() + 1), PAL_STATUS_CORRUPT_CONTENT);
  // A site's zone is a part of all zones.
  EXPECT_EQ(with(Zone::VT_MOST_NODES, zone.num_nodes()), PAL_STATUS_OK);
  EXPECT_EQ(with(Zone::VT_MOST_NODES, zone.num_nodes() + 1), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(with(Zone::VT_MOST_BOUNDARY_NODES, zone.most_nodes() + 1), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(with(Zone::VT_MOST_ELEMENTS, zone.num_elements() + 1), PAL_STATUS_CORRUPT_CONTENT);
}

TEST_F(Contradiction, MaterialsOfZones) {
  using Material = pack::ZoneMaterial;
  const auto with = [](auto&& change) {
    return status_with<Material>(tables_with_zones().nonlinear_zone()->materials(), change,
                                 zone_pack_bytes());
  };
  EXPECT_EQ(with([](Material*) {}), PAL_STATUS_OK);
  EXPECT_EQ(with([](Material* m) { m->law = static_cast<pack::ZoneLaw>(pack::kZoneLaws); }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(with([](Material* m) { m->constants[0] = std::nan(""); }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(with([](Material* m) { m->constants[1] = 1e300; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(with([](Material* m) { m->law = pack::ZoneLaw::ogden; }), PAL_STATUS_CORRUPT_CONTENT)
      << "alpha is 0";
}

TEST_F(Contradiction, ZonesWithoutTheOrgan) {
  for (const flatbuffers::voffset_t table : {pack::Pack::VT_ORGAN, pack::Pack::VT_NONLINEAR_ZONE}) {
    AlignedBytes copy = copy_of(zone_pack_bytes().bytes());
    const auto* root =
        flatbuffers::GetRoot<flatbuffers::Table>(copy.bytes().data() + sizeof(pack::PackHeader));
    flatbuffers::WriteScalar<flatbuffers::voffset_t>(const_cast<uint8_t*>(root->GetVTable()) + table, 0);
    repair_checksum(copy.bytes());
    EXPECT_EQ(open_status(copy.bytes()), PAL_STATUS_CORRUPT_CONTENT) << table;
  }
}

}  // namespace contradicting_zones_test
}  // namespace palpate::test::mutated_pack_fixture
