// Packs whose content was changed and whose checksum was made right again. Opening may accept or refuse them,
// but whatever it accepts must be served without a crash and without a number that is not finite.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

#include "runtime/src/surface_bvh.hpp"
#include "schemas/monomials.hpp"
#include "schemas/pack_generated.h"
#include "tests/support/changed_pack.hpp"
#include "tests/support/nightly.hpp"
#include "tests/support/runtime_session.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/small_pack.hpp"

namespace palpate::test {
namespace {

// Asks everything of a pack that opened. False when an answer with status OK is not finite.
bool serves_finite_numbers(const pal_pack* pack) {
  pal_pack_info info = {};
  info.struct_size = sizeof info;
  pal_geometry geometry = {};
  geometry.struct_size = sizeof geometry;
  if (pal_pack_get_info(pack, &info) != PAL_STATUS_OK ||
      pal_pack_get_geometry(pack, &geometry) != PAL_STATUS_OK) {
    return false;
  }
  bool finite = std::isfinite(info.max_displacement) && std::isfinite(info.tip_radius) &&
                std::isfinite(info.mean_surface_edge);
  for (uint32_t i = 0; i < 3 * geometry.num_nodes; ++i)
    finite = finite && std::isfinite(geometry.positions[i]);
  for (uint32_t i = 0; i < 3 * geometry.num_triangles; ++i)
    finite = finite && geometry.triangles[i] < geometry.num_nodes;
  for (int32_t label = 40; label < 70; ++label) {
    uint32_t index = 0;
    uint32_t node = 0;
    if (pal_pack_find_site(pack, label, &index) == PAL_STATUS_OK)
      finite = finite && pal_pack_get_site_node(pack, index, &node) == PAL_STATUS_OK && node < info.num_nodes;
    if (pal_pack_find_contact_node(pack, label, &index) == PAL_STATUS_OK)
      finite = finite && index < info.num_contact_nodes;
  }
  for (const double at : {0.0, 0.4, 0.49, -1e15, info.max_displacement}) {
    const double position[3] = {at, 0.3 - at, 0.4};
    palpate::SurfaceHit hit;
    if (!find_nearest_surface_point(*pack, position, 3, hit)) continue;
    finite = finite && std::isfinite(hit.distance);
    for (int i = 0; i < 3; ++i) {
      finite = finite && hit.sites[i] < info.num_sites && hit.weights[i] >= 0 && hit.weights[i] <= 1 &&
               std::isfinite(hit.point[i]) && std::isfinite(hit.normal[i]);
    }
  }
  constexpr uint32_t kContacts = 3;
  std::vector<pal_real> field(size_t{3} * info.num_nodes);
  for (const pal_model model : {PAL_MODEL_AUTO, PAL_MODEL_LINEAR, PAL_MODEL_ZONE}) {
    const pal_session_config config = session_config(pack, model, kContacts, model == PAL_MODEL_ZONE ? 0 : 2);
    size_t bytes = 0;
    if (pal_session_required_bytes(pack, &config, &bytes) != PAL_STATUS_OK) continue;
    AlignedBytes arena(bytes);
    pal_session* session = nullptr;
    if (pal_session_init(pack, &config, arena.bytes().data(), bytes, &session) != PAL_STATUS_OK) return false;
    for (uint32_t frame = 0; frame < 10; ++frame) {
      const uint32_t fixed[2] = {frame % info.num_contact_nodes, 0};
      if (frame == 8 && pal_session_set_fixed(session, fixed, 2) != PAL_STATUS_OK) continue;
      const double reach[] = {0.3, 1, 3, 1e8};
      const double d = info.max_displacement * reach[frame % 4];
      const uint32_t count = frame < 5 ? 1 : frame % kContacts + 1;
      pal_contact contacts[kContacts];
      for (uint32_t c = 0; c < count; ++c)
        contacts[c] = {
            (5 * frame + c) % info.num_sites, {0.5 * d, -0.3 * d, c == 1 ? 0.0 : -d}, 0, {}, {}, {}};
      pal_contact_result results[kContacts] = {};
      if (pal_contact_frame(session, contacts, count, results) != PAL_STATUS_OK) continue;
      for (uint32_t c = 0; c < count; ++c) finite = finite && all_finite(results[c]);
      if (pal_visual_frame(session, field.data(), kNodeBytes) == PAL_STATUS_OK)
        finite = finite && all_finite(field);
    }
  }
  return finite;
}

// Opens the bytes; true when they are refused, or served well.
bool refused_or_served(std::span<const unsigned char> bytes, int& accepted) {
  alignas(16) unsigned char storage[PAL_PACK_STORAGE_BYTES];
  pal_pack* pack = nullptr;
  if (pal_pack_open_memory(bytes.data(), bytes.size(), PAL_VERIFY_ONCE, storage, sizeof storage, &pack) !=
      PAL_STATUS_OK)
    return true;
  ++accepted;
  const bool served = serves_finite_numbers(pack);
  pal_pack_close(pack);
  return served;
}

template <typename T>
void store(std::span<unsigned char> bytes, size_t at, T value) {
  if (at + sizeof value <= bytes.size()) memcpy(bytes.data() + at, &value, sizeof value);
}

// Changes one number in [begin, end): a bit, a byte, or a value that programs trip over.
void mutate(std::span<unsigned char> bytes, size_t begin, size_t end, std::mt19937_64& random) {
  const auto any = [&](size_t count) { return std::uniform_int_distribution<size_t>(0, count - 1)(random); };
  const size_t at = begin + any(end - begin);
  const size_t at4 = at / 4 * 4;
  const size_t at8 = at / 8 * 8;
  constexpr uint32_t kIntegers[] = {0,      1,          2,          0x7f,       0xff,
                                    0xffff, 0x7fffffff, 0x80000000, 0xfffffff0, 0xffffffff};
  constexpr double kReals[] = {0.0,
                               -0.0,
                               -1.0,
                               1e-320,
                               1e-300,
                               1e-150,
                               1e-20,
                               -1e-5,
                               1e20,
                               1e150,
                               -1e300,
                               1e308,
                               std::numeric_limits<double>::quiet_NaN(),
                               std::numeric_limits<double>::infinity()};
  constexpr float kFloats[] = {-1.0f, 1e-42f, 1e20f, 3e38f, -3e38f, std::numeric_limits<float>::quiet_NaN()};
  switch (any(7)) {
    case 0:
      bytes[at] ^= static_cast<unsigned char>(1U << any(8));
      break;
    case 1:
      bytes[at] = static_cast<unsigned char>(random());
      break;
    case 2:
      store(bytes, at4, kIntegers[any(std::size(kIntegers))]);
      break;
    case 3:
      store(bytes, at4, static_cast<uint32_t>(any(64)));
      break;
    case 4:
      store(bytes, at8, kReals[any(std::size(kReals))]);
      break;
    case 5:
      store(bytes, at4, kFloats[any(std::size(kFloats))]);
      break;
    default:
      store(bytes, at8, random());
  }
}

// `rounds` packs with one to four mutations each in [begin, end) of the file.
void check_mutations(std::span<const unsigned char> original, size_t begin, size_t end, int rounds,
                     uint64_t seed, int& accepted) {
  std::mt19937_64 random(seed);
  AlignedBytes copy = copy_of(original);
  for (int round = 0; round < rounds; ++round) {
    const std::span<unsigned char> bytes = copy.bytes();
    memcpy(bytes.data(), original.data(), original.size());
    const int mutations = 1 + static_cast<int>(random() % 4);
    for (int i = 0; i < mutations; ++i) mutate(bytes, begin, end, random);
    repair_checksum(bytes);
    ASSERT_TRUE(refused_or_served(bytes, accepted)) << "seed " << seed << ", round " << round;
  }
}

// PALPATE_MUTATED_PACKS=100000 makes as many in each test.
int num_rounds() {
  return static_cast<int>(rounds_by("PALPATE_MUTATED_PACKS", kSanitized ? 200 : 1000, 20000));
}

TEST(MutatedPack, Tables) {
  const auto bytes = small_pack_bytes().bytes();
  const pack::PackHeader header = header_of(bytes);
  int accepted = 0;
  check_mutations(bytes, header.tables_offset, header.tables_offset + header.tables_bytes, 2 * num_rounds(),
                  2, accepted);
  EXPECT_GT(accepted, num_rounds() / 20);  // names, error figures: else frames were never reached
}

TEST(MutatedPack, EachSegment) {
  const auto bytes = small_pack_bytes().bytes();
  const pack::Pack& tables = *pack::GetPack(bytes.data() + sizeof(pack::PackHeader));
  uint64_t seed = 100;
  int accepted = 0;
  for (const pack::Segment* segment :
       {tables.geometry()->labels(), tables.geometry()->positions(), tables.geometry()->triangles(),
        tables.sites()->contact_nodes(), tables.sites()->site_nodes(), tables.sites()->patch_starts(),
        tables.sites()->patch_nodes(), tables.linear_dd()->contact_compliance(),
        tables.linear_dd()->field_compliance(), tables.polynomial_dd()->sites(),
        tables.polynomial_dd()->energy(), tables.polynomial_dd()->coefficients(),
        tables.polynomial_dd()->field(), tables.surface_bvh()->primitives(), tables.surface_bvh()->nodes(),
        tables.surface_bvh()->primitive_normals(), tables.surface_bvh()->site_normals()}) {
    check_mutations(bytes, segment->offset(), segment->offset() + segment->bytes(), num_rounds() / 5, ++seed,
                    accepted);
  }
  EXPECT_GT(accepted, num_rounds() / 5);
}

TEST(MutatedPack, EachSegmentOfZones) {
  const auto bytes = between_pack_bytes().bytes();
  const pack::Pack& tables = *pack::GetPack(bytes.data() + sizeof(pack::PackHeader));
  const pack::NonlinearZone& zone = *tables.nonlinear_zone();
  uint64_t seed = 300;
  int accepted = 0;
  for (const pack::Segment* segment :
       {zone.nodes(), zone.elements(), zone.node_elements(), zone.materials(), zone.compliance(),
        zone.field_compliance(), zone.field_units(), zone.force_scale(), zone.exterior(),
        zone.exterior_units(), zone.pair_fields(), zone.pair_weights(), zone.more_rings(),
        tables.linear_dd()->contact_compliance(), tables.sites()->patch_nodes()}) {
    check_mutations(bytes, segment->offset(), segment->offset() + segment->bytes(), num_rounds() / 5, ++seed,
                    accepted);
  }
  const pack::PackHeader header = header_of(bytes);
  check_mutations(bytes, header.tables_offset, header.tables_offset + header.tables_bytes, num_rounds() / 2,
                  ++seed, accepted);
  EXPECT_GT(accepted, num_rounds() / 5);
}

// Where one array holds numbers of two kinds.
TEST(MutatedPack, EachSegmentOfRoundedPolynomials) {
  const auto bytes = rounded_pack_bytes().bytes();
  const pack::PolynomialDd& polynomial =
      *pack::GetPack(bytes.data() + sizeof(pack::PackHeader))->polynomial_dd();
  uint64_t seed = 200;
  int accepted = 0;
  for (const pack::Segment* segment :
       {polynomial.sites(), polynomial.energy(), polynomial.coefficients(), polynomial.field()}) {
    check_mutations(bytes, segment->offset(), segment->offset() + segment->bytes(), num_rounds() / 5, ++seed,
                    accepted);
  }
  EXPECT_GT(accepted, num_rounds() / 20);
}

TEST(MutatedPack, Header) {
  int accepted = 0;
  check_mutations(small_pack_bytes().bytes(), 0, sizeof(pack::PackHeader), num_rounds(), 3, accepted);
}

// ---- Contradictions made on purpose, each of which a check of meaning must refuse.

// After `change` of the array in `segment`, checksum repaired.
template <typename T, typename Change>
pal_status status_with(const pack::Segment* segment, Change&& change,
                       const AlignedBytes& original = small_pack_bytes()) {
  AlignedBytes copy = copy_of(original.bytes());
  change(reinterpret_cast<T*>(copy.bytes().data() + segment->offset()));
  repair_checksum(copy.bytes());
  return open_status(copy.bytes());
}

class Contradiction : public ::testing::Test {
 protected:
  const pack::Pack& tables() const {
    return *pack::GetPack(small_pack_bytes().bytes().data() + sizeof(pack::PackHeader));
  }
  const SmallPack& small_ = small_pack();
};

TEST_F(Contradiction, Geometry) {
  const pack::Geometry& geometry = *tables().geometry();
  EXPECT_EQ(status_with<int32_t>(geometry.labels(), [](int32_t*) {}), PAL_STATUS_OK);
  EXPECT_EQ(status_with<int32_t>(geometry.labels(), [](int32_t* labels) { labels[5] = labels[4]; }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with<double>(geometry.positions(), [](double* x) { x[3] = std::nan(""); }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with<uint32_t>(geometry.triangles(), [&](uint32_t* t) { t[7] = geometry.num_nodes(); }),
            PAL_STATUS_CORRUPT_CONTENT);
}

TEST_F(Contradiction, Sites) {
  const pack::ContactSites& sites = *tables().sites();
  EXPECT_EQ(status_with<uint32_t>(sites.contact_nodes(), [](uint32_t* n) { std::swap(n[1], n[2]); }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with<uint32_t>(sites.site_nodes(), [](uint32_t* n) { n[11] = 1u << 30; }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with<uint32_t>(sites.patch_starts(), [](uint32_t* s) { s[0] = 1; }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with<uint32_t>(sites.patch_starts(), [](uint32_t* s) { s[3] = s[2]; }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with<uint32_t>(sites.patch_starts(), [](uint32_t* s) { s[3] = 0xffffffff; }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with<uint32_t>(sites.patch_starts(), [](uint32_t* s) { ++s[12]; }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with<uint32_t>(sites.patch_nodes(), [](uint32_t* n) { n[1] = n[0]; }),
            PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(
      status_with<uint32_t>(sites.patch_nodes(), [&](uint32_t* n) { n[3] = sites.num_contact_nodes(); }),
      PAL_STATUS_CORRUPT_CONTENT);
}

// A compliance is symmetric and positive definite, so |a_ij| <= sqrt(a_ii a_jj); anything else would feed a
// device energy, or have a nonsensical inverse.
TEST_F(Contradiction, LinearCompliance) {
  const pack::LinearDd& linear = *tables().linear_dd();
  const auto changed = [&](auto&& change) {
    return status_with<double>(linear.contact_compliance(), change);
  };
  const size_t own = 9 * pack::lower_block(1, 1);  // of contact node 1
  const size_t other = 9 * pack::lower_block(1, 0);
  EXPECT_EQ(changed([](double*) {}), PAL_STATUS_OK);
  EXPECT_EQ(changed([&](double* a) { a[own] = 0; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(changed([&](double* a) { a[own] = -a[own]; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(changed([&](double* a) { a[own] = 1e-300; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(changed([&](double* a) { a[own] = 1e300; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(changed([&](double* a) { a[own + 2] += 1e-3 * a[0]; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(changed([&](double* a) { a[own + 2] = a[own + 6] = 1e3; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(changed([&](double* a) { a[other + 5] = 1e3; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_with<pal_real>(linear.field_compliance(), [](pal_real* c) { c[9] = 1e38f; }),
            PAL_STATUS_CORRUPT_CONTENT);
}

// Where a field of a table of the pack lies. Scalars that are not the default lie in the table, to be overwritten.
unsigned char* field_of_table(AlignedBytes& copy, flatbuffers::voffset_t table,
                              flatbuffers::voffset_t field) {
  unsigned char* tables = copy.bytes().data() + header_of(copy.bytes()).tables_offset;
  unsigned char* place = flatbuffers::GetMutableRoot<flatbuffers::Table>(tables)
                             ->GetPointer<flatbuffers::Table*>(table)
                             ->GetAddressOf(field);
  if (place == nullptr) throw std::runtime_error("not in the tables");
  return place;
}

// With this scalar in a table, checksum repaired.
template <typename T>
pal_status status_with_scalar(flatbuffers::voffset_t table, flatbuffers::voffset_t field, T value,
                              const AlignedBytes& original) {
  AlignedBytes copy = copy_of(original.bytes());
  memcpy(field_of_table(copy, table, field), &value, sizeof value);
  repair_checksum(copy.bytes());
  return open_status(copy.bytes());
}

// With so many bytes of an array in place of all of them.
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

// With room for so many bytes behind all others.
AlignedBytes with_room(const AlignedBytes& original, uint64_t num_bytes) {
  const uint64_t end = original.bytes().size();
  AlignedBytes longer(end + num_bytes / pack::kAlignment * pack::kAlignment + pack::kAlignment);
  memcpy(longer.bytes().data(), original.bytes().data(), end);
  pack::PackHeader header = header_of(longer.bytes());
  header.file_bytes = longer.bytes().size();
  set_header(longer.bytes(), header);
  return longer;
}

// So many fields of each pair, and arrays behind all others that are as long as that: nothing contradicts the number.
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

// The same of the degree of what is outside of zones.
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

// Of the weights there are as many as the degree asks for.
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
  // A node's elements: all of its own, each once, one node's behind the other's.
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
  // Volume patches follow one another, and are no larger than a frame has room for.
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
  // Their numbers are any, their units are not.
  for (const double wrong : {1e30, -1e30, std::nan("")}) {
    for (const pack::Segment* units : {zone.field_units(), zone.exterior_units()}) {
      EXPECT_EQ(status_with<double>(
                    units, [&](double* of_columns) { of_columns[2] = wrong; }, original),
                PAL_STATUS_CORRUPT_CONTENT)
          << wrong;
    }
  }
  // What the organ outside adds.
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

const pack::PolynomialDd& polynomials_of(const AlignedBytes& bytes) {
  return *pack::GetPack(bytes.bytes().data() + sizeof(pack::PackHeader))->polynomial_dd();
}

// After `change` of the record of site 2.
template <typename Change>
pal_status status_with_site(Change&& change, const AlignedBytes& original = small_pack_bytes()) {
  return status_with<pack::PolynomialSite>(
      polynomials_of(original).sites(), [&](pack::PolynomialSite* sites) { change(sites[2]); }, original);
}

TEST_F(Contradiction, PolynomialSites) {
  using Site = pack::PolynomialSite;
  for (const AlignedBytes* bytes : {&small_pack_bytes(), &rounded_pack_bytes()}) {
    const bool rounded = bytes == &rounded_pack_bytes();
    SCOPED_TRACE(rounded ? "rounded" : "plain");
    const uint32_t degree = polynomials_of(*bytes).degree();
    const auto changed = [&](auto&& change) { return status_with_site(change, *bytes); };
    EXPECT_EQ(changed([](Site&) {}), PAL_STATUS_OK);
    for (const float wrong : {std::nanf(""), HUGE_VALF, -1e-3f, 3e38f}) {
      EXPECT_EQ(changed([&](Site& site) { site.linear_unit = wrong; }),
                rounded ? PAL_STATUS_CORRUPT_CONTENT : PAL_STATUS_OK)
          << wrong;
    }
    EXPECT_EQ(changed([](Site& site) { site.samples = 0; }), PAL_STATUS_OK) << "no frame reads it";
    for (const uint32_t wrong : {0u, degree + 1, 8u, 0xffffffffu})
      EXPECT_EQ(changed([&](Site& site) { site.degree = wrong; }), PAL_STATUS_CORRUPT_CONTENT) << wrong;
    // Other ranks and degrees need other arrays than there are.
    EXPECT_EQ(changed([](Site& site) { --site.degree; }), PAL_STATUS_CORRUPT_CONTENT);
    for (const uint32_t wrong : {pack::kMostRank + 1, pack::kMostRank + 2, 0x80000000u, 0xffffffffu})
      EXPECT_EQ(changed([&](Site& site) { site.rank = wrong; }), PAL_STATUS_CORRUPT_CONTENT) << wrong;
    EXPECT_EQ(changed([](Site& site) { site.rank += 2; }), PAL_STATUS_CORRUPT_CONTENT);
    EXPECT_EQ(changed([](Site& site) { --site.rank; }), PAL_STATUS_CORRUPT_CONTENT);
    // Each part begins where the last one ends: no gap, no overlap, no order of its own.
    for (uint64_t Site::*start : {&Site::energy_start, &Site::coefficients_start, &Site::field_start}) {
      for (const uint64_t by : {uint64_t{1}, uint64_t{64}, ~uint64_t{0}, uint64_t{1} << 63})
        EXPECT_EQ(changed([&](Site& site) { site.*start += by; }), PAL_STATUS_CORRUPT_CONTENT) << by;
      EXPECT_EQ(changed([&](Site& site) { site.*start = 0; }), PAL_STATUS_CORRUPT_CONTENT);
      EXPECT_EQ(status_with<Site>(
                    polynomials_of(*bytes).sites(), [&](Site* sites) { sites[0].*start = 64; }, *bytes),
                PAL_STATUS_CORRUPT_CONTENT);
    }
    for (const double wrong : {std::nan(""), HUGE_VAL, -HUGE_VAL, 1e16, -1e16, 1e300})
      EXPECT_EQ(changed([&](Site& site) { site.to_unit[5] = wrong; }), PAL_STATUS_CORRUPT_CONTENT) << wrong;
    for (const double scale : {0.0, 1e-20, 1e-300}) {
      EXPECT_EQ(changed([&](Site& site) {
                  for (double& entry : site.to_unit) entry *= scale;
                }),
                PAL_STATUS_CORRUPT_CONTENT)
          << scale;
    }
    // Not of a domain within the scene's largest displacement, or of one that has no end in some direction.
    for (const double scale : {0.9, 4.5}) {
      EXPECT_EQ(changed([&](Site& site) {
                  for (double& entry : site.to_unit) entry *= scale;
                }),
                PAL_STATUS_CORRUPT_CONTENT)
          << scale;
    }
    EXPECT_EQ(changed([](Site& site) { std::copy(site.to_unit, site.to_unit + 3, site.to_unit + 3); }),
              PAL_STATUS_CORRUPT_CONTENT);
    for (const double wrong : {std::nan(""), HUGE_VAL, -HUGE_VAL})
      EXPECT_EQ(changed([&](Site& site) { site.min_jacobian = wrong; }), PAL_STATUS_CORRUPT_CONTENT) << wrong;
    for (const double wrong : {std::nan(""), HUGE_VAL, -1e-3})
      EXPECT_EQ(changed([&](Site& site) { site.basis_error = wrong; }), PAL_STATUS_CORRUPT_CONTENT) << wrong;
  }
}

TEST_F(Contradiction, PolynomialNumbers) {
  const pal_real not_a_number = std::numeric_limits<pal_real>::quiet_NaN();
  for (const AlignedBytes* bytes : {&small_pack_bytes(), &rounded_pack_bytes()}) {
    const bool rounded = bytes == &rounded_pack_bytes();
    SCOPED_TRACE(rounded ? "rounded" : "plain");
    // Columns of int16 may hold any integer.
    const pal_status of_columns = rounded ? PAL_STATUS_OK : PAL_STATUS_CORRUPT_CONTENT;
    const pack::PolynomialDd& polynomial = polynomials_of(*bytes);
    const auto with_energy = [&](double value) {
      return status_with<double>(
          polynomial.energy(), [&](double* e) { e[40] = value; }, *bytes);
    };
    EXPECT_EQ(with_energy(1e300), PAL_STATUS_CORRUPT_CONTENT);
    EXPECT_EQ(with_energy(std::nan("")), PAL_STATUS_CORRUPT_CONTENT);
    const auto with = [&](const pack::Segment* segment, size_t place, pal_real value) {
      return status_with<pal_real>(
          segment, [&](pal_real* u) { u[place] = value; }, *bytes);
    };
    for (const pal_real wrong : {not_a_number, pal_real(3e38), pal_real(-1e20)}) {
      EXPECT_EQ(with(polynomial.coefficients(), 7, wrong), PAL_STATUS_CORRUPT_CONTENT) << wrong;
      // Columns of L in the first panel, and in the last of all.
      EXPECT_EQ(with(polynomial.field(), 40, wrong), of_columns) << wrong;
      const auto& last = reinterpret_cast<const pack::PolynomialSite*>(bytes->bytes().data() +
                                                                       polynomial.sites()->offset())[11];
      const uint64_t in_panel = pack::field_panel_bytes(3 + last.rank, rounded) / sizeof(pal_real);
      const uint64_t of_linear = rounded ? pack::rounded_panel_numbers(3) * sizeof(int16_t) / sizeof(pal_real)
                                         : 3 * pack::kPanelRows;
      const uint64_t in_last = polynomial.field()->bytes() / sizeof(pal_real) - in_panel + of_linear - 1;
      EXPECT_EQ(with(polynomial.field(), in_last, wrong), of_columns) << wrong;
    }
    // A basis of the plain one is within 1.
    for (const pal_real wrong : {not_a_number, pal_real(3e38), pal_real(-1.01)}) {
      EXPECT_EQ(with(polynomial.field(), 3 * pack::kPanelRows + 5, wrong), of_columns) << wrong;
    }
  }
}

TEST_F(Contradiction, PolynomialTable) {
  const AlignedBytes& rounded = rounded_pack_bytes();
  const uint32_t degree = polynomials_of(rounded).degree();
  const auto with_degree = [&](uint32_t value) {
    return status_with_scalar(pack::Pack::VT_POLYNOMIAL_DD, pack::PolynomialDd::VT_DEGREE, value, rounded);
  };
  EXPECT_EQ(with_degree(degree), PAL_STATUS_OK);
  for (const uint32_t wrong : {0u, degree - 1, pack::kMaxDegree + 1, 0xffffffffu})
    EXPECT_EQ(with_degree(wrong), PAL_STATUS_CORRUPT_CONTENT) << wrong;
  const auto with_precision = [&](uint8_t value) {
    return status_with_scalar(pack::Pack::VT_POLYNOMIAL_DD, pack::PolynomialDd::VT_PRECISION, value, rounded);
  };
  EXPECT_EQ(with_precision(1), PAL_STATUS_OK);
  for (const uint8_t wrong : {uint8_t{0}, uint8_t{2}, uint8_t{255}})
    EXPECT_EQ(with_precision(wrong), PAL_STATUS_CORRUPT_CONTENT) << int{wrong};
}

// Columns of zones that are real are over their units; of int16 any are.
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

// Whole packs, each array as long as its sites say: of degrees and ranks that no frame has room for.
TEST_F(Contradiction, PolynomialsBeyondWhatAFrameHolds) {
  const auto written = [&](int degree, uint32_t rank, bool rounded) {
    std::vector<SiteResult> results = small_.polynomials;
    SitePolynomial& last = results.back().polynomial;
    const auto terms = [](int first, int end) {
      return static_cast<Eigen::Index>(
          pack::num_monomials(static_cast<uint32_t>(first), static_cast<uint32_t>(end)));
    };
    last.degree = degree;
    last.energy = Eigen::VectorXd::Ones(terms(2, degree + 1));
    last.basis = Eigen::MatrixXd::Zero(last.linear.rows(), rank);
    last.coefficients = Eigen::MatrixXd::Ones(terms(2, degree), rank) * 1e-3;
    PackContent content = small_.content();
    content.polynomials = &results;
    content.rounded = rounded;
    return write_pack(content);
  };
  for (const bool rounded : {false, true}) {
    const auto status_of = [&](int degree, uint32_t rank) {
      return open_status(written(degree, rank, rounded).bytes());
    };
    EXPECT_EQ(status_of(1, 0), PAL_STATUS_OK);
    constexpr int kDegree = pack::kMaxDegree;
    constexpr uint32_t kRank = pack::kMostRank;
    EXPECT_EQ(status_of(kDegree, kRank), PAL_STATUS_OK);
    EXPECT_EQ(status_of(kDegree, kRank + 1), PAL_STATUS_CORRUPT_CONTENT);
    EXPECT_EQ(status_of(kDegree + 1, kRank), PAL_STATUS_CORRUPT_CONTENT);
  }
  // The last site without its last columns, and the arrays as much shorter: an odd column is one of a pair.
  const auto status_of_rank = [&](uint32_t fewer, uint32_t fewer_packed) {
    AlignedBytes copy = written(3, 8, true);
    unsigned char* tables = copy.bytes().data() + header_of(copy.bytes()).tables_offset;
    auto* polynomial =
        flatbuffers::GetMutableRoot<flatbuffers::Table>(tables)->GetPointer<flatbuffers::Table*>(
            pack::Pack::VT_POLYNOMIAL_DD);
    const auto shorten = [&](flatbuffers::voffset_t field, uint64_t bytes) {
      auto* segment = reinterpret_cast<pack::Segment*>(polynomial->GetAddressOf(field));
      *segment = pack::Segment(segment->offset(), segment->bytes() - bytes);
    };
    const uint64_t panels = pack::num_panels(static_cast<uint32_t>(small_.sites.packed_nodes.size()));
    shorten(pack::PolynomialDd::VT_COEFFICIENTS, fewer * pack::num_monomials(2, 3) * sizeof(pal_real));
    shorten(pack::PolynomialDd::VT_FIELD, panels * (pack::field_panel_bytes(3 + 8, true) -
                                                    pack::field_panel_bytes(3 + 8 - fewer_packed, true)));
    auto* sites =
        reinterpret_cast<pack::PolynomialSite*>(copy.bytes().data() + polynomials_of(copy).sites()->offset());
    sites[small_.sites.sites.size() - 1].rank -= fewer;
    repair_checksum(copy.bytes());
    return open_status(copy.bytes());
  };
  for (uint32_t fewer = 0; fewer <= 3; ++fewer)
    EXPECT_EQ(status_of_rank(fewer, fewer), PAL_STATUS_OK) << fewer;
  EXPECT_EQ(status_of_rank(2, 0), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_of_rank(1, 3), PAL_STATUS_CORRUPT_CONTENT);
}

// Opened without a look at its numbers, a damaged pack may answer with them, but no more than that.
TEST_F(Contradiction, PolynomialsNobodyVerified) {
  AlignedBytes copy = copy_of(rounded_pack_bytes().bytes());
  const pack::PolynomialDd& table = polynomials_of(copy);
  auto* coefficients = reinterpret_cast<pal_real*>(copy.bytes().data() + table.coefficients()->offset());
  const uint64_t count = table.coefficients()->bytes() / sizeof(pal_real);
  for (const double wrong : {std::nan(""), HUGE_VAL, -HUGE_VAL, 3e38}) {
    std::fill(coefficients, coefficients + count, static_cast<pal_real>(wrong));
    const OpenPack pack(copy, PAL_VERIFY_NEVER);
    OwnedSession session(pack.get(), PAL_MODEL_POLYNOMIAL, 1, 0);
    session.touch({{0, {0.01, 0.01, -0.02}, 0, {}, {}, {}}});
    session.field();
  }
}

// Scene values that are finite and still make no sense in double or float arithmetic.
TEST_F(Contradiction, Scales) {
  const auto written = [&](auto&& change) {
    Scene scene = small_.scene;
    change(scene);
    const PackContent content = small_.content();
    const AlignedBytes bytes =
        write_pack({small_.model, scene, small_.sites, content.linear, content.polynomials, content.rounded,
                    content.inputs, content.surveys});
    return open_status(bytes.bytes());
  };
  EXPECT_EQ(written([](Scene&) {}), PAL_STATUS_OK);
  for (const double absurd : {0.0, -1.0, 1e-300, 1e300, std::nan(""), HUGE_VAL}) {
    EXPECT_EQ(written([&](Scene& scene) { scene.max_displacement = absurd; }), PAL_STATUS_CORRUPT_CONTENT)
        << absurd;
    const auto in_units = [&](double metres, double newtons) {
      return written([&](Scene& scene) {
        scene.length_unit = std::string(1, 'a');
        scene.force_unit = std::string(1, 'b');
        scene.metres_per_length_unit = metres;
        scene.newtons_per_force_unit = newtons;
      });
    };
    EXPECT_EQ(in_units(absurd, 1), PAL_STATUS_CORRUPT_CONTENT) << absurd;
    EXPECT_EQ(in_units(1, absurd), PAL_STATUS_CORRUPT_CONTENT) << absurd;
    EXPECT_EQ(in_units(1e-6, 1e-6), PAL_STATUS_OK);
  }
  EXPECT_EQ(written([](Scene& scene) { scene.max_contacts = 0; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(written([](Scene& scene) { scene.max_contacts = 65; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(written([](Scene& scene) { scene.tip_radius = -1; }), PAL_STATUS_CORRUPT_CONTENT);
}

// Two surveys of one model: their bins together are more than a pack view holds.
TEST_F(Contradiction, Surveys) {
  const auto written = [&](std::vector<ModelSurvey> surveys) {
    PackContent content = small_.content();
    content.surveys = std::move(surveys);
    return open_status(write_pack(content).bytes());
  };
  const ModelSurvey survey = small_.surveys[0];
  EXPECT_EQ(written({}), PAL_STATUS_OK);
  EXPECT_EQ(written({survey}), PAL_STATUS_OK);
  EXPECT_EQ(written({survey, survey}), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(written(std::vector<ModelSurvey>(20, survey)), PAL_STATUS_CORRUPT_CONTENT);
  ModelSurvey broken = survey;
  broken.table.bins[1].from = 0.3;  // a gap
  EXPECT_EQ(written({broken}), PAL_STATUS_CORRUPT_CONTENT);
  broken = survey;
  broken.table.bins[2].displacement.bound = std::nan("");
  EXPECT_EQ(written({broken}), PAL_STATUS_CORRUPT_CONTENT);
  broken = survey;
  broken.table.bins[2].force.bound = -1;
  EXPECT_EQ(written({broken}), PAL_STATUS_CORRUPT_CONTENT);
  broken = survey;
  broken.table.bins[2].samples = 0;  // measured on nothing, and yet sure
  broken.table.bins[2].force.bound = 0.5;
  EXPECT_EQ(written({broken}), PAL_STATUS_CORRUPT_CONTENT);
  broken.table.bins[2].displacement = broken.table.bins[2].force = {1, 1, 1, 1, 0};
  EXPECT_EQ(written({broken}), PAL_STATUS_OK);
  broken.table.bins[2].displacement.growth = 0.5;
  EXPECT_EQ(written({broken}), PAL_STATUS_CORRUPT_CONTENT);
  for (const double bad : {-0.1, 1.1, std::nan("")}) {
    broken = survey;
    broken.table.bins[2].displacement.growth = bad;
    EXPECT_EQ(written({broken}), PAL_STATUS_CORRUPT_CONTENT) << bad;
    broken = survey;
    broken.table.bins[2].force.growth = bad;
    EXPECT_EQ(written({broken}), PAL_STATUS_CORRUPT_CONTENT) << bad;
  }
  broken = survey;
  broken.table.bins.back().to = 0.9;  // not the whole range
  EXPECT_EQ(written({broken}), PAL_STATUS_CORRUPT_CONTENT);
  ModelSurvey sets = survey;
  sets.sets.kinds = {{SetKind::two_near, 9, 0, 0, {}, {}}};
  sets.sets.over_load = {0.1, 0.1};
  EXPECT_EQ(written({sets}), PAL_STATUS_OK);
  for (const double bad : {-0.1, std::nan(""), std::numeric_limits<double>::infinity()}) {
    for (double* bound : {&broken.sets.over_load.displacement, &broken.sets.over_load.force,
                          &broken.sets.over_reach.displacement, &broken.sets.over_reach.force}) {
      broken = sets;
      *bound = bad;
      EXPECT_EQ(written({broken}), PAL_STATUS_CORRUPT_CONTENT) << bad;
    }
  }
}

TEST_F(Contradiction, InwardNormals) {
  PackContent content = small_.content();
  Scene inward = small_.scene;
  inward.directions = Directions::inward;
  ContactSites sites = small_.sites;
  const PackContent changed{content.model,       inward,          sites,          content.linear,
                            content.polynomials, content.rounded, content.inputs, content.surveys};
  EXPECT_EQ(open_status(write_pack(changed).bytes()), PAL_STATUS_OK);
  sites.sites[3].inward *= 1.1;
  EXPECT_EQ(open_status(write_pack(changed).bytes()), PAL_STATUS_CORRUPT_CONTENT);
  sites.sites[3].inward.setConstant(std::nan(""));
  EXPECT_EQ(open_status(write_pack(changed).bytes()), PAL_STATUS_CORRUPT_CONTENT);
}

TEST_F(Contradiction, NoModelAtAll) {
  PackContent content = small_.content();
  content.linear = nullptr;
  content.polynomials = nullptr;
  EXPECT_EQ(open_status(write_pack(content).bytes()), PAL_STATUS_CORRUPT_CONTENT);
}

}  // namespace
}  // namespace palpate::test
