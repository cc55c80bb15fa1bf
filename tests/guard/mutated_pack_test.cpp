// Packs with random damage and a repaired checksum. Opening refuses the pack, or every call gives finite
// numbers and none crashes.
#include <gtest/gtest.h>

#include "tests/support/mutated_pack_fixture.hpp"

namespace palpate::test::mutated_pack_fixture {
namespace mutated_pack_test {

// Makes every kind of call on an open pack. False when a result with status OK is not finite.
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

// Opens the bytes; true when opening refuses them or all results are finite.
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

// Changes one number in [begin, end): a bit, a byte, or a special value such as NaN.
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

// PALPATE_MUTATED_PACKS sets the number of packs in each test.
int num_rounds() {
  return static_cast<int>(rounds_by("PALPATE_MUTATED_PACKS", kSanitized ? 200 : 1000, 20000));
}

TEST(MutatedPack, Tables) {
  const auto bytes = small_pack_bytes().bytes();
  const pack::PackHeader header = header_of(bytes);
  int accepted = 0;
  check_mutations(bytes, header.tables_offset, header.tables_offset + header.tables_bytes, 2 * num_rounds(),
                  2, accepted);
  EXPECT_GT(accepted, num_rounds() / 20);  // names, error figures; else frames were never reached
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
  const auto bytes = zone_pack_bytes().bytes();
  const pack::Pack& tables = *pack::GetPack(bytes.data() + sizeof(pack::PackHeader));
  const pack::Organ& organ = *tables.organ();
  uint64_t seed = 300;
  int accepted = 0;
  for (const pack::Segment* segment :
       {tables.nonlinear_zone()->materials(), organ.nodes(), organ.elements(), organ.node_elements(),
        organ.fronts(), organ.order(), organ.rows(), tables.linear_dd()->contact_compliance(),
        tables.sites()->patch_nodes()}) {
    check_mutations(bytes, segment->offset(), segment->offset() + segment->bytes(), num_rounds() / 5, ++seed,
                    accepted);
  }
  const pack::PackHeader header = header_of(bytes);
  check_mutations(bytes, header.tables_offset, header.tables_offset + header.tables_bytes, num_rounds() / 2,
                  ++seed, accepted);
  EXPECT_GT(accepted, num_rounds() / 5);
}

// A segment holds numbers of two kinds here: int16 columns and real units.
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

}  // namespace mutated_pack_test
}  // namespace palpate::test::mutated_pack_fixture
