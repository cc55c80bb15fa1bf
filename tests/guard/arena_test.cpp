// A session needs exactly the bytes that it declares, and refuses any smaller arena with a status.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "runtime/src/session/session_state.hpp"
#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"

namespace palpate::test {
namespace arena_test {

constexpr unsigned char kCanary = 0xa5;

bool all_canary(std::span<const unsigned char> bytes) {
  return std::all_of(bytes.begin(), bytes.end(), [](unsigned char byte) { return byte == kCanary; });
}

size_t required_bytes(const OpenPack& pack, const pal_session_config& config) {
  size_t bytes = 0;
  require(pal_session_required_bytes(pack.get(), &config, &bytes), "required_bytes");
  return bytes;
}

// Configs of every model, with small and large capacities.
std::vector<pal_session_config> configs(const OpenPack& pack) {
  std::vector<pal_session_config> all;
  for (const pal_model model : {PAL_MODEL_AUTO, PAL_MODEL_LINEAR, PAL_MODEL_POLYNOMIAL}) {
    for (const uint32_t contacts : {1u, 3u, 64u}) {
      for (const uint32_t fixed : {0u, 5u, 1024u}) {
        all.push_back(session_config(pack.get(), model, contacts, fixed));
        all.back().max_tools = contacts == 3 ? 16 : 1;
      }
    }
  }
  for (const uint32_t contacts : {1u, 3u, 8u}) {
    if (pack.info().zone_rings == 0) break;
    for (const uint32_t fixed : {0u, 32u}) {
      all.push_back(session_config(pack.get(), PAL_MODEL_ZONE, contacts, fixed));
      all.back().max_tools = 2;
      all.back().patches_turn = fixed > 0 ? 1 : 0;
    }
  }
  return all;
}

// Uses every array of a session to its capacity.
void use_all_of(const OpenPack& pack, const pal_session_config& config, pal_session* session) {
  const pal_pack_info info = pack.info();
  std::vector<pal_real> field(size_t{3} * info.num_nodes);
  std::vector<pal_contact_result> results(config.max_contacts);
  std::vector<uint32_t> fixed(config.max_fixed);
  ASSERT_GT(info.num_contact_nodes, 0U);
  int answered = 0;
  for (uint32_t frame = 0; frame < 40; ++frame) {
    for (uint32_t i = 0; i < config.max_fixed; ++i) fixed[i] = (frame + i) % info.num_contact_nodes;
    const bool may_fix = config.model != PAL_MODEL_POLYNOMIAL;
    const uint32_t num_fixed = may_fix && frame % 2 == 0 ? config.max_fixed : 0;
    ASSERT_EQ(pal_session_set_fixed(session, fixed.data(), num_fixed), PAL_STATUS_OK);
    const uint32_t count = config.model == PAL_MODEL_POLYNOMIAL || frame % 4 == 3 ? 1 : config.max_contacts;
    std::vector<pal_contact> contacts(count);
    for (uint32_t c = 0; c < count; ++c)
      contacts[c] = {(frame + c) % info.num_sites, {0.01, -0.02, -0.03}, 0, {}, {}, {}};
    if (config.patches_turn != 0) {
      std::vector<double> orientations;
      for (uint32_t c = 0; c < count; ++c) orientations.insert(orientations.end(), {0.995, 0, 0, 0.0999});
      ASSERT_EQ(pal_session_set_orientations(session, orientations.data(), count), PAL_STATUS_OK);
    }
    answered += pal_contact_frame(session, contacts.data(), count, results.data()) == PAL_STATUS_OK;
    if (config.model == PAL_MODEL_ZONE) {
      ASSERT_EQ(pal_session_refine(session, 0, nullptr), PAL_STATUS_OK);
    }
    ASSERT_EQ(pal_visual_frame(session, field.data(), kNodeBytes), PAL_STATUS_OK);
  }
  EXPECT_EQ(answered, 40);
  // The same through tools: the last tool holds as many contacts as the session has room for.
  ASSERT_EQ(pal_session_set_fixed(session, nullptr, 0), PAL_STATUS_OK);
  pal_status status = PAL_STATUS_OK;
  for (uint32_t site = 0; status == PAL_STATUS_OK; ++site) {
    const pal_hold hold = pal_default_hold(site % info.num_sites);
    status = pal_tool_hold(session, config.max_tools - 1, &hold);
  }
  ASSERT_EQ(status, config.model == PAL_MODEL_POLYNOMIAL && config.max_contacts > 1
                        ? PAL_STATUS_MODEL_CANNOT_ANSWER
                        : PAL_STATUS_CAPACITY_EXCEEDED);
  std::vector<pal_tool_result> tools(config.max_tools);
  const std::vector<pal_pose> poses(config.max_tools, {{0.001, 0, -0.01}, {1, 0, 0, 0}});
  pal_haptic_input input = {};
  input.struct_size = sizeof input;
  input.num_tools = config.max_tools;
  input.poses = poses.data();
  input.result_bytes = sizeof(pal_tool_result);
  input.num_results = config.max_tools;
  ASSERT_EQ(pal_haptic_frame(session, &input, tools.data()), PAL_STATUS_OK);
  ASSERT_EQ(pal_visual_frame(session, field.data(), kNodeBytes), PAL_STATUS_OK);
}

TEST(Arena, OneByteTooFewIsRefusedAndNothingIsWritten) {
  const OpenPack pack(zone_pack_bytes());
  for (const pal_session_config& config : configs(pack)) {
    const size_t bytes = required_bytes(pack, config);
    AlignedBytes arena(bytes);
    std::memset(arena.bytes().data(), kCanary, bytes);
    pal_session* session = nullptr;
    EXPECT_EQ(pal_session_init(pack.get(), &config, arena.bytes().data(), bytes - 1, &session),
              PAL_STATUS_ARENA_TOO_SMALL);
    EXPECT_EQ(session, nullptr);
    EXPECT_TRUE(all_canary(arena.bytes()));
  }
}

TEST(Arena, GrownByteByByteItServesAtTheDeclaredSize) {
  const OpenPack pack(zone_pack_bytes());
  for (const pal_session_config& config : configs(pack)) {
    const size_t declared = required_bytes(pack, config);
    AlignedBytes arena(declared);
    pal_session* session = nullptr;
    size_t size = 0;
    pal_status status = PAL_STATUS_ARENA_TOO_SMALL;
    // In large steps at first, byte by byte over the last hundred.
    for (; size <= declared; size += size + 1100 < declared ? 1000 : 1) {
      status = pal_session_init(pack.get(), &config, arena.bytes().data(), size, &session);
      if (status != PAL_STATUS_ARENA_TOO_SMALL) break;
    }
    EXPECT_EQ(status, PAL_STATUS_OK);
    EXPECT_EQ(size, declared);
    use_all_of(pack, config, session);
  }
}

TEST(Arena, BytesBehindTheDeclaredSizeStayUntouched) {
  const OpenPack pack(zone_pack_bytes());
  constexpr size_t kBehind = 4096;
  for (const pal_session_config& config : configs(pack)) {
    const size_t bytes = required_bytes(pack, config);
    AlignedBytes memory(64 + bytes + kBehind);
    std::memset(memory.bytes().data(), kCanary, memory.bytes().size());
    pal_session* session = nullptr;
    ASSERT_EQ(pal_session_init(pack.get(), &config, memory.bytes().data() + 64, bytes + kBehind, &session),
              PAL_STATUS_OK);
    use_all_of(pack, config, session);
    EXPECT_TRUE(all_canary(memory.bytes().first(64)));
    EXPECT_TRUE(all_canary(memory.bytes().last(kBehind)));
    // Breaks the guard on purpose: a write to the arena's last cache line must trip the canary.
    EXPECT_FALSE(all_canary(memory.bytes().subspan(bytes, 64 + kBehind)));
  }
}

// The declared size equals the sum of the arrays.
TEST(Arena, DeclaredSizeIsWhatTheArraysNeed) {
  const OpenPack pack(zone_pack_bytes());
  const pal_pack_info info = pack.info();
  const pal_session_config config = session_config(pack.get(), PAL_MODEL_LINEAR, 1, 0);
  const size_t dofs = size_t{3} * info.max_patch_nodes;
  const size_t stride = (dofs + 7) / 8 * 8;
  const size_t inverse = dofs * stride * sizeof(double);
  // The sets at three corners that answer, and the next three sets.
  const size_t num_sets = 6;
  const size_t unit_forces = num_sets * 3 * stride * sizeof(double);
  const size_t columns = 3 * 3 * stride * sizeof(double);
  const size_t maps = 3 * info.num_contact_nodes * sizeof(uint32_t);
  // Three snapshots, with a contact between sites that holds the nodes of three patches.
  const size_t fields = size_t{3} * 3 * info.max_patch_nodes * (sizeof(uint32_t) + 3 * sizeof(pal_real));
  constexpr size_t kLines = 104;  // cache lines that small arrays round up to
  const size_t rest =
      sizeof(pal_session) + num_sets * sizeof(LinearSet) + config.max_tools * sizeof(ToolState) + kLines * 64;
  const size_t needed = inverse + unit_forces + columns + maps + fields;
  EXPECT_GE(required_bytes(pack, config), needed);
  EXPECT_LE(required_bytes(pack, config), needed + rest);
}

TEST(Arena, MisalignedIsRefused) {
  const OpenPack pack(zone_pack_bytes());
  const pal_session_config config = pal_default_session_config(pack.get());
  const size_t bytes = required_bytes(pack, config);
  AlignedBytes arena(bytes + 64);
  std::memset(arena.bytes().data(), kCanary, arena.bytes().size());
  pal_session* session = nullptr;
  for (size_t shift = 1; shift < 64; ++shift) {
    EXPECT_EQ(pal_session_init(pack.get(), &config, arena.bytes().data() + shift, bytes, &session),
              PAL_STATUS_ARENA_MISALIGNED);
  }
  EXPECT_EQ(session, nullptr);
  EXPECT_TRUE(all_canary(arena.bytes()));
  EXPECT_EQ(pal_session_init(pack.get(), &config, arena.bytes().data() + 64, bytes, &session), PAL_STATUS_OK);
}

TEST(Arena, PackStorageIsCheckedToo) {
  const auto bytes = zone_pack_bytes().bytes();
  alignas(16) unsigned char storage[PAL_PACK_STORAGE_BYTES + 16];
  std::memset(storage, kCanary, sizeof storage);
  pal_pack* pack = nullptr;
  EXPECT_EQ(pal_pack_open_memory(bytes.data(), bytes.size(), PAL_VERIFY_ONCE, storage, 8, &pack),
            PAL_STATUS_ARENA_TOO_SMALL);
  EXPECT_EQ(pal_pack_open_memory(bytes.data(), bytes.size(), PAL_VERIFY_ONCE, storage + 1,
                                 PAL_PACK_STORAGE_BYTES, &pack),
            PAL_STATUS_ARENA_MISALIGNED);
  EXPECT_EQ(pal_pack_open_memory(bytes.data() + 1, bytes.size() - 1, PAL_VERIFY_ONCE, storage,
                                 PAL_PACK_STORAGE_BYTES, &pack),
            PAL_STATUS_ARENA_MISALIGNED);
  EXPECT_EQ(pack, nullptr);
  EXPECT_TRUE(all_canary(storage));
}

TEST(Arena, ExceedingACapacityChangesNothing) {
  const OpenPack pack(zone_pack_bytes());
  OwnedSession session(pack.get(), PAL_MODEL_LINEAR, 2,
                       2);  // results independent of the frames before
  session.fix({3});
  const std::vector<pal_contact> held = {{1, {0.01, 0, -0.02}, 0, {}, {}, {}},
                                         {8, {0, 0.01, -0.01}, 0, {}, {}, {}}};
  const auto before = session.touch(held);
  const std::vector<pal_real> field = session.field();

  const std::vector<pal_contact> three = {{0, {0, 0, -0.03}, 0, {}, {}, {}},
                                          {4, {0, 0, -0.03}, 0, {}, {}, {}},
                                          {9, {0, 0, -0.03}, 0, {}, {}, {}}};
  std::vector<pal_contact_result> results(3);
  std::memset(static_cast<void*>(results.data()), kCanary, 3 * sizeof results[0]);
  EXPECT_EQ(pal_contact_frame(session.get(), three.data(), 3, results.data()), PAL_STATUS_CAPACITY_EXCEEDED);
  EXPECT_TRUE(all_canary({reinterpret_cast<const unsigned char*>(results.data()), 3 * sizeof results[0]}));
  const std::vector<uint32_t> fixed = {0, 1, 2};
  EXPECT_EQ(pal_session_set_fixed(session.get(), fixed.data(), 3), PAL_STATUS_CAPACITY_EXCEEDED);
  EXPECT_EQ(session.field(), field);
  const auto after = session.touch(held);
  for (size_t c = 0; c < held.size(); ++c) {
    for (int i = 0; i < 3; ++i) EXPECT_EQ(before[c].force[i], after[c].force[i]);
  }
}

TEST(Arena, ConfigOutsideItsRangeIsRefused) {
  const OpenPack pack(zone_pack_bytes());
  const auto status_of = [&](pal_session_config config) {
    size_t bytes = 77;
    const pal_status status = pal_session_required_bytes(pack.get(), &config, &bytes);
    EXPECT_EQ(bytes == 77, status != PAL_STATUS_OK);
    return status;
  };
  EXPECT_EQ(status_of(session_config(pack.get(), PAL_MODEL_AUTO, 64, 1024)), PAL_STATUS_OK);
  EXPECT_EQ(status_of(session_config(pack.get(), PAL_MODEL_AUTO, 0, 0)), PAL_STATUS_BAD_ARGUMENT);
  EXPECT_EQ(status_of(session_config(pack.get(), PAL_MODEL_AUTO, 65, 0)), PAL_STATUS_BAD_ARGUMENT);
  EXPECT_EQ(status_of(session_config(pack.get(), PAL_MODEL_AUTO, 1, 1025)), PAL_STATUS_BAD_ARGUMENT);
  pal_session_config config = pal_default_session_config(pack.get());
  const int unknown = 77;  // a value that a C program can pass
  static_assert(sizeof unknown == sizeof config.model);
  std::memcpy(&config.model, &unknown, sizeof unknown);
  EXPECT_EQ(status_of(config), PAL_STATUS_BAD_ARGUMENT);
  config = pal_default_session_config(pack.get());
  config.zone_rings = pack.info().zone_rings + 1;
  EXPECT_EQ(status_of(config), PAL_STATUS_BAD_ARGUMENT);
  config.zone_rings = 0;
  config.zone_iterations = 17;
  EXPECT_EQ(status_of(config), PAL_STATUS_BAD_ARGUMENT);
  constexpr uint32_t kFirstRelease = 144;
  config.struct_size = kFirstRelease;  // without both fields
  EXPECT_EQ(status_of(config), PAL_STATUS_OK);
  config.struct_size = kFirstRelease - 1;
  EXPECT_EQ(status_of(config), PAL_STATUS_BAD_STRUCT_SIZE);
}

}  // namespace arena_test
}  // namespace palpate::test
