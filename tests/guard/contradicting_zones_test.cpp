// Opening refuses packs whose zone tables contradict one another.
#include <gtest/gtest.h>

#include "tests/support/mutated_pack_fixture.hpp"

namespace palpate::test::mutated_pack_fixture {
namespace contradicting_zones_test {

// Status with an array of `num_bytes` bytes in place of the whole array.
pal_status status_with_bytes(flatbuffers::voffset_t table, flatbuffers::voffset_t field, uint64_t num_bytes,
                             const AlignedBytes& original) {
  AlignedBytes copy = copy_of(original.bytes());
  auto* segment = reinterpret_cast<pack::Segment*>(field_of_table(copy, table, field));
  *segment = pack::Segment(segment->offset(), num_bytes);
  repair_checksum(copy.bytes());
  return open_status(copy.bytes());
}

TEST_F(Contradiction, PairsOfZones) {
  const AlignedBytes& original = zone_pack_bytes();
  const pack::Pack& tables = *pack::GetPack(original.bytes().data() + sizeof(pack::PackHeader));
  const pack::NonlinearZone& zone = *tables.nonlinear_zone();
  const uint32_t count = zone.num_pair_fields();
  ASSERT_GT(count, 0u);
  const auto with_count = [&](uint32_t value) {
    return status_with_scalar(pack::Pack::VT_NONLINEAR_ZONE, pack::NonlinearZone::VT_NUM_PAIR_FIELDS, value,
                              original);
  };
  EXPECT_EQ(with_count(count), PAL_STATUS_OK);
  EXPECT_EQ(with_count(0), PAL_STATUS_OK) << "what pairs add is left out";
  for (const uint32_t wrong :
       {1u, count - 1, count + 1, count + 4, pack::kMostPairFields + 4, 0x80000000u, 0xfffffffcu})
    EXPECT_EQ(with_count(wrong), PAL_STATUS_CORRUPT_CONTENT) << wrong;
  for (const auto field : {pack::NonlinearZone::VT_PAIR_FIELDS, pack::NonlinearZone::VT_PAIR_WEIGHTS}) {
    const uint64_t bytes =
        (field == pack::NonlinearZone::VT_PAIR_FIELDS ? zone.pair_fields() : zone.pair_weights())->bytes();
    const auto with_bytes = [&](uint64_t value) {
      return status_with_bytes(pack::Pack::VT_NONLINEAR_ZONE, field, value, original);
    };
    EXPECT_EQ(with_bytes(bytes), PAL_STATUS_OK);
    for (const uint64_t wrong : {uint64_t{0}, bytes - 64, bytes + 64})
      EXPECT_EQ(with_bytes(wrong), PAL_STATUS_CORRUPT_CONTENT) << wrong;
  }
}

// A copy with room for `num_bytes` behind all segments.
AlignedBytes with_room(const AlignedBytes& original, uint64_t num_bytes) {
  const uint64_t end = original.bytes().size();
  AlignedBytes longer(end + num_bytes / pack::kAlignment * pack::kAlignment + pack::kAlignment);
  memcpy(longer.bytes().data(), original.bytes().data(), end);
  pack::PackHeader header = header_of(longer.bytes());
  header.file_bytes = longer.bytes().size();
  set_header(longer.bytes(), header);
  return longer;
}

// Status with `count` fields of each pair and arrays of matching length: only the capacity can refuse the
// pack.
pal_status status_with_pair_fields(uint32_t count, const AlignedBytes& original) {
  const pack::Pack& tables = *pack::GetPack(original.bytes().data() + sizeof(pack::PackHeader));
  const pack::NonlinearZone& zone = *tables.nonlinear_zone();
  const uint64_t of_field = zone.pair_fields()->bytes() / zone.num_pair_fields();
  const uint64_t weights = 2 * pack::kPairColumns;
  const uint64_t of_weight = zone.pair_weights()->bytes() / (weights + zone.num_pair_fields());
  const uint64_t end = original.bytes().size();
  const pack::Segment fields(end, count * of_field);
  AlignedBytes longer = with_room(original, (count + weights) * std::max(of_field, of_weight));
  const auto field_of_zone = [&](flatbuffers::voffset_t field) {
    return field_of_table(longer, pack::Pack::VT_NONLINEAR_ZONE, field);
  };
  memcpy(field_of_zone(pack::NonlinearZone::VT_NUM_PAIR_FIELDS), &count, sizeof count);
  *reinterpret_cast<pack::Segment*>(field_of_zone(pack::NonlinearZone::VT_PAIR_FIELDS)) = fields;
  *reinterpret_cast<pack::Segment*>(field_of_zone(pack::NonlinearZone::VT_PAIR_WEIGHTS)) =
      pack::Segment(end, (count + weights) * of_weight);
  repair_checksum(longer.bytes());
  return open_status(longer.bytes());
}

// Status with another degree of the exterior's series and arrays of matching length.
pal_status status_with_exterior_degree(uint32_t degree, const AlignedBytes& original) {
  const pack::Pack& tables = *pack::GetPack(original.bytes().data() + sizeof(pack::PackHeader));
  const pack::NonlinearZone& zone = *tables.nonlinear_zone();
  const uint32_t columns = pack::num_monomials(2, zone.exterior_degree());
  const uint32_t other_columns = pack::num_monomials(2, degree);
  const bool rounded = zone.precision() == pack::FieldPrecision::i16;
  const uint64_t bytes = zone.exterior()->bytes() / pack::field_panel_bytes(columns, rounded) *
                         pack::field_panel_bytes(other_columns, rounded);
  const uint64_t of_units = zone.exterior_units()->bytes() / columns * other_columns;
  const uint64_t end = pack::round_up(original.bytes().size() + bytes, pack::kAlignment);
  AlignedBytes longer = with_room(original, end + of_units - original.bytes().size());
  const auto field_of_zone = [&](flatbuffers::voffset_t field) {
    return field_of_table(longer, pack::Pack::VT_NONLINEAR_ZONE, field);
  };
  memcpy(field_of_zone(pack::NonlinearZone::VT_EXTERIOR_DEGREE), &degree, sizeof degree);
  *reinterpret_cast<pack::Segment*>(field_of_zone(pack::NonlinearZone::VT_EXTERIOR)) =
      pack::Segment(original.bytes().size(), bytes);
  *reinterpret_cast<pack::Segment*>(field_of_zone(pack::NonlinearZone::VT_EXTERIOR_UNITS)) =
      pack::Segment(end, of_units);
  repair_checksum(longer.bytes());
  return open_status(longer.bytes());
}

TEST_F(Contradiction, DegreesOutsideOfZones) {
  for (uint32_t right = pack::kLeastZoneDegree; right <= pack::kMostZoneDegree; ++right)
    EXPECT_EQ(status_with_exterior_degree(right, zone_pack_bytes()), PAL_STATUS_OK) << right;
  for (const uint32_t wrong : {pack::kLeastZoneDegree - 1, pack::kMostZoneDegree + 1})
    EXPECT_EQ(status_with_exterior_degree(wrong, zone_pack_bytes()), PAL_STATUS_CORRUPT_CONTENT) << wrong;
}

// The degree determines the number of weights.
TEST_F(Contradiction, DegreesOfPairs) {
  const uint32_t degree = pack::GetPack(zone_pack_bytes().bytes().data() + sizeof(pack::PackHeader))
                              ->nonlinear_zone()
                              ->pair_degree();
  for (const uint32_t value : {0u, 1u, 2u, 3u, 4u, 0x80000000u}) {
    EXPECT_EQ(status_with_scalar(pack::Pack::VT_NONLINEAR_ZONE, pack::NonlinearZone::VT_PAIR_DEGREE, value,
                                 zone_pack_bytes()),
              value == degree ? PAL_STATUS_OK : PAL_STATUS_CORRUPT_CONTENT)
        << value;
  }
}

TEST_F(Contradiction, PairFieldsBeyondWhatAFrameHolds) {
  for (const uint32_t right : {4u, 8u, pack::kMostPairFields})
    EXPECT_EQ(status_with_pair_fields(right, zone_pack_bytes()), PAL_STATUS_OK) << right;
  for (const uint32_t wrong : {1u, 6u, pack::kMostPairFields - 1, pack::kMostPairFields + 4})
    EXPECT_EQ(status_with_pair_fields(wrong, zone_pack_bytes()), PAL_STATUS_CORRUPT_CONTENT) << wrong;
}

TEST_F(Contradiction, Zones) {
  const AlignedBytes& original = between_pack_bytes();
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
  EXPECT_EQ(status_with<double>(
                zone.compliance(), [](double* c) { c[1] = 1e30; }, original),
            PAL_STATUS_CORRUPT_CONTENT);
  // Columns may hold any integer; their units must be finite and in range.
  for (const double wrong : {1e30, -1e30, std::nan("")}) {
    for (const pack::Segment* units : {zone.field_units(), zone.exterior_units()}) {
      EXPECT_EQ(status_with<double>(
                    units, [&](double* of_columns) { of_columns[2] = wrong; }, original),
                PAL_STATUS_CORRUPT_CONTENT)
          << wrong;
    }
  }
  // The terms of the exterior.
  const auto num_rows =
      static_cast<uint32_t>(zone.exterior()->bytes() * pack::kPanelNodes /
                            (uint64_t{zone.rings()} * tables().sites()->num_sites() *
                             pack::field_panel_bytes(pack::num_monomials(2, zone.exterior_degree()),
                                                     zone.precision() == pack::FieldPrecision::i16)));
  EXPECT_EQ(with_node([&](pack::ZoneNode* n) { n[4].row = num_rows; }), PAL_STATUS_CORRUPT_CONTENT);
  ASSERT_TRUE(zone.between()) << "any node that is free may be on a boundary";
  EXPECT_EQ(with_node([](pack::ZoneNode* n) { n[4].row = pack::kNoNode; }), PAL_STATUS_CORRUPT_CONTENT);
  for (const double wrong : {0.0, -1.0, 1e-300, 1e300, std::nan("")}) {
    EXPECT_EQ(status_with<double>(
                  zone.force_scale(), [&](double* scale) { scale[1] = wrong; }, original),
              PAL_STATUS_CORRUPT_CONTENT)
        << wrong;
  }
  const auto with_more_rings = [&](uint8_t rings) {
    return status_with<uint8_t>(
        zone.more_rings(), [&](uint8_t* more) { more[1] = rings; }, original);
  };
  EXPECT_EQ(with_more_rings(pack::kMostZoneRings), PAL_STATUS_OK);
  EXPECT_EQ(with_more_rings(pack::kMostZoneRings + 1), PAL_STATUS_CORRUPT_CONTENT);
  for (const float wrong : {1e30f, -1e30f, std::nanf("")}) {
    EXPECT_EQ(status_with<float>(
                  zone.pair_weights(), [&](float* weights) { weights[3] = wrong; }, original),
              PAL_STATUS_CORRUPT_CONTENT)
        << wrong;
  }
}

// Columns stored as reals are bounded by their units; columns of int16 may hold any integer.
TEST_F(Contradiction, ColumnsOfZones) {
  for (const bool rounded : {false, true}) {
    SCOPED_TRACE(rounded);
    ZoneTables zone = small_.zone;
    zone.rounded = rounded;
    PackContent content = small_.content();
    content.zone = &zone;
    const AlignedBytes bytes = write_pack(content);
    const pack::NonlinearZone& table =
        *pack::GetPack(bytes.bytes().data() + sizeof(pack::PackHeader))->nonlinear_zone();
    for (const pack::Segment* columns : {table.field_compliance(), table.exterior()}) {
      const auto with = [&](uint64_t place, pal_real value) {
        return status_with<pal_real>(
            columns, [&](pal_real* numbers) { numbers[place] = value; }, bytes);
      };
      for (const uint64_t place : {uint64_t{9}, columns->bytes() / sizeof(pal_real) - 1}) {
        EXPECT_EQ(with(place, pal_real(-0.5)), PAL_STATUS_OK);
        for (const pal_real wrong :
             {std::numeric_limits<pal_real>::quiet_NaN(), pal_real(1e38), pal_real(-1.01)})
          EXPECT_EQ(with(place, wrong), rounded ? PAL_STATUS_OK : PAL_STATUS_CORRUPT_CONTENT) << wrong;
      }
    }
    const auto with_precision = [&](uint8_t value) {
      return status_with_scalar(pack::Pack::VT_NONLINEAR_ZONE, pack::NonlinearZone::VT_PRECISION, value,
                                bytes);
    };
    if (rounded) {
      EXPECT_EQ(with_precision(1), PAL_STATUS_OK);
      for (const uint8_t wrong : {uint8_t{0}, uint8_t{2}, uint8_t{255}})
        EXPECT_EQ(with_precision(wrong), PAL_STATUS_CORRUPT_CONTENT) << int{wrong};
    }
  }
}

}  // namespace contradicting_zones_test
}  // namespace palpate::test::mutated_pack_fixture
