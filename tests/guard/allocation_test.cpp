// The runtime allocates nothing: this executable replaces malloc, free and their relatives by counting
// versions.
#include <gtest/gtest.h>
#include <malloc.h>
#include <stdlib.h>

#include <atomic>
#include <new>
#include <palpate/palpate.hpp>
#include <string>

#include "runtime/src/pack/surface_bvh.hpp"
#include "tests/support/runtime_session.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/small_pack.hpp"

namespace {
std::atomic<long> allocations = 0;
std::atomic<long> releases = 0;
}  // namespace

// Sanitizers bring a malloc of their own, which the counting malloc would hide.
#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define PALPATE_SANITIZED 1  // clang
#endif
#elif defined(__SANITIZE_ADDRESS__)
#define PALPATE_SANITIZED 1  // GCC
#endif
#if !defined(PALPATE_SANITIZED) && defined(__GLIBC__)
#define PALPATE_COUNTS_ALLOCATIONS 1
// glibc's own allocator, under the names that replacements may call.
extern "C" {
// NOLINTBEGIN(bugprone-reserved-identifier)
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);
void __libc_free(void*);
// NOLINTEND(bugprone-reserved-identifier)

void* malloc(size_t bytes) {
  ++allocations;
  return __libc_malloc(bytes);
}
void* calloc(size_t count, size_t bytes) {
  ++allocations;
  return __libc_calloc(count, bytes);
}
void* realloc(void* old, size_t bytes) {
  ++allocations;
  return __libc_realloc(old, bytes);
}
void* memalign(size_t alignment, size_t bytes) {
  ++allocations;
  return __libc_memalign(alignment, bytes);
}
void* aligned_alloc(size_t alignment, size_t bytes) {
  ++allocations;
  return __libc_memalign(alignment, bytes);
}
int posix_memalign(void** place, size_t alignment, size_t bytes) {
  ++allocations;
  *place = __libc_memalign(alignment, bytes);
  return *place == nullptr ? 12 : 0;  // ENOMEM
}
void free(void* memory) {
  ++releases;
  __libc_free(memory);
}
}
#endif

namespace palpate::test {
namespace allocation_test {

// Number of allocations and releases during `call`.
template <typename Call>
long counted(Call&& call) {
  const long before = allocations + releases;
  call();
  return allocations + releases - before;
}

class Allocation : public ::testing::Test {
 protected:
  void SetUp() override {
#ifndef PALPATE_COUNTS_ALLOCATIONS
    GTEST_SKIP() << "the sanitizers' allocator cannot be replaced; the release build counts";
#endif
  }
};

TEST_F(Allocation, CounterCounts) {
  void* volatile kept = nullptr;  // volatile, or the compiler removes the pair
  const auto keep = [&](void* memory) { kept = memory; };
  EXPECT_EQ(counted([&] { keep(malloc(8)), free(kept); }), 2);
  EXPECT_EQ(counted([&] { keep(calloc(2, 8)), free(kept); }), 2);
  EXPECT_EQ(counted([&] { keep(realloc(nullptr, 8)), free(kept); }), 2);
  EXPECT_EQ(counted([&] { keep(aligned_alloc(64, 64)), free(kept); }), 2);
  EXPECT_EQ(counted([&] { keep(memalign(64, 64)), free(kept); }), 2);
  EXPECT_EQ(counted([&] { keep(new int), delete static_cast<int*>(kept); }), 2);
  EXPECT_EQ(counted([&] { keep(new int[100]), delete[] static_cast<int*>(kept); }), 2);
  EXPECT_GE(counted([&] { std::string(100, 'x').swap(*std::make_unique<std::string>()); }), 4);
  EXPECT_EQ(counted([] {}), 0);
}

// Breaks the guard on purpose: touch() returns a std::vector, and the counter sees the allocation.
TEST_F(Allocation, AnAllocationInAFrameIsSeen) {
  const OpenPack pack(small_pack_bytes());
  OwnedSession session(pack.get(), PAL_MODEL_AUTO);
  EXPECT_GT(counted([&] {
              session.touch({{0, {0, 0, -0.01}, 0, {}, {}, {}}});
            }),
            0);  // `touch` returns a std::vector
}

TEST_F(Allocation, NoneFromInitToTheLastFrame) {
  const OpenPack pack(zone_pack_bytes());
  const pal_pack_info info = pack.info();
  std::vector<pal_real> field(size_t{3} * info.num_nodes);
  for (const pal_model model : {PAL_MODEL_AUTO, PAL_MODEL_LINEAR, PAL_MODEL_POLYNOMIAL, PAL_MODEL_ZONE}) {
    pal_session_config config = session_config(pack.get(), model, 4, 6);
    size_t bytes = 0;
    ASSERT_EQ(counted([&] { require(pal_session_required_bytes(pack.get(), &config, &bytes), "bytes"); }), 0);
    AlignedBytes arena(bytes);
    pal_session* session = nullptr;
    ASSERT_EQ(counted([&] {
                require(pal_session_init(pack.get(), &config, arena.bytes().data(), bytes, &session), "init");
              }),
              0);
    int answered = 0;
    pal_contact_result results[4];
    const long in_frames = counted([&] {
      for (uint32_t frame = 0; frame < 400; ++frame) {
        const uint32_t fixed[3] = {frame % info.num_contact_nodes, (frame / 3) % info.num_contact_nodes, 0};
        const pal_status set = pal_session_set_fixed(session, fixed, (frame / 7) % 4);
        answered += set == PAL_STATUS_OK;
        const uint32_t count = (frame / 5) % 5;
        pal_contact contacts[4];
        for (uint32_t c = 0; c < count; ++c) {
          contacts[c] = {
              (frame / 3 + 5 * c) % info.num_sites, {1e-3 * frame, 0.01 * c, -1e-4 * frame}, 0, {}, {}, {}};
        }
        answered += pal_contact_frame(session, contacts, count, results) == PAL_STATUS_OK;
        answered += pal_session_refine(session, 0, nullptr) == PAL_STATUS_OK;
        answered += pal_visual_frame(session, field.data(), kNodeBytes) == PAL_STATUS_OK;
      }
    });
    EXPECT_EQ(in_frames, 0);
    EXPECT_GT(answered, 400);  // else no frame was answered
  }
}

TEST_F(Allocation, NoneWithTools) {
  const OpenPack pack(small_pack_bytes());
  pal_session_config config = pal_default_session_config(pack.get());
  config.max_contacts = 3;
  config.max_force = 1;
  const OwnedSession session(pack.get(), config);
  std::vector<uint64_t> recording(1 << 15);
  std::vector<pal_real> field(size_t{3} * pack.info().num_nodes);
  std::vector<pal_real> normals(field.size());
  pal_touch touch = {};
  touch.struct_size = sizeof touch;
  touch.law = PAL_LAW_TOUCH;
  pal_tool_result results[4];
  size_t recorded = 0;
  int answered = 0;
  int touched = 0;
  EXPECT_EQ(counted([&] {
              answered +=
                  pal_session_record(session.get(), recording.data(), recording.size() * 8) == PAL_STATUS_OK;
              answered += pal_tool_set_touch(session.get(), 1, &touch) == PAL_STATUS_OK;
              for (int frame = 0; frame < 200; ++frame) {
                const pal_hold hold = pal_default_hold(static_cast<uint32_t>(frame) % 12);
                if (frame % 20 == 5) answered += pal_tool_hold(session.get(), 0, &hold) == PAL_STATUS_OK;
                if (frame % 20 == 15) answered += pal_tool_release(session.get(), 0) == PAL_STATUS_OK;
                const pal_pose poses[2] = {{{0, 0, -1e-4 * frame}, {1, 0, 0, 0}},
                                           {{0.2, 0.2, 0.4 - 5e-4 * (frame % 100)}, {1, 0, 0, 0}}};
                pal_haptic_input input = {};
                input.struct_size = sizeof input;
                input.num_tools = 2;
                input.poses = poses;
                input.dt = 0.001;
                input.result_bytes = sizeof results[0];
                input.num_results = 4;
                answered += pal_haptic_frame(session.get(), &input, results) == PAL_STATUS_OK;
                touched += results[1].num_contacts != 0;
                answered += pal_visual_frame(session.get(), field.data(), kNodeBytes) == PAL_STATUS_OK;
                answered += pal_pack_compute_normals(pack.get(), field.data(), kNodeBytes, normals.data(),
                                                     kNodeBytes) == PAL_STATUS_OK;
              }
              answered += pal_session_stop_recording(session.get(), &recorded, nullptr) == PAL_STATUS_OK;
            }),
            0);
  EXPECT_EQ(answered, 3 + 20 + 3 * 200);
  EXPECT_GT(touched, 20);

  pal_session_config again = {};
  again.struct_size = sizeof again;
  pal_replay replay = {};
  replay.struct_size = sizeof replay;
  const OwnedSession second(pack.get(), config);
  EXPECT_EQ(counted([&] {
              require(pal_recording_get_config(recording.data(), recorded, &again), "config");
              while (replay.ended == 0)
                require(pal_session_replay(second.get(), recording.data(), recorded, &replay), "replay");
            }),
            0);
  EXPECT_EQ(replay.frames, 200U);
}

TEST_F(Allocation, NoneInQueries) {
  const OpenPack pack(small_pack_bytes());
  pal_pack_info info = {};
  pal_geometry geometry = {};
  info.struct_size = sizeof info;
  geometry.struct_size = sizeof geometry;
  uint32_t index = 0;
  const void* bytes = nullptr;
  size_t num_bytes = 0;
  bool ok = true;
  const double position[3] = {0.2, 0.3, 0.4};
  SurfaceHit hit;
  pal_surface_point point;
  EXPECT_EQ(counted([&] {
              ok = find_nearest_surface_point(*pack.get(), position, 0, hit) &&
                   pal_pack_get_info(pack.get(), &info) == PAL_STATUS_OK &&
                   pal_pack_get_geometry(pack.get(), &geometry) == PAL_STATUS_OK &&
                   pal_pack_find_surface_point(pack.get(), position, &point) == PAL_STATUS_OK &&
                   pal_pack_find_site(pack.get(), 54, &index) == PAL_STATUS_OK &&
                   pal_pack_find_contact_node(pack.get(), 54, &index) == PAL_STATUS_OK &&
                   pal_pack_get_site_node(pack.get(), 0, &index) == PAL_STATUS_OK &&
                   pal_pack_get_bytes(pack.get(), &bytes, &num_bytes) == PAL_STATUS_OK &&
                   pal_default_session_config(pack.get()).max_contacts == 3;
              for (int status = 0; status < 64; ++status)
                ok = ok && pal_status_text(static_cast<pal_status>(status)) != nullptr;
            }),
            0);
  EXPECT_TRUE(ok);
}

// Opening maps the file and checks it; neither needs the heap, nor does a refusal.
TEST_F(Allocation, NoneInOpenAndClose) {
  const auto bytes = small_pack_bytes().bytes();
  const TempDir dir;
  const std::string file =
      dir.write("a.pack", {reinterpret_cast<const char*>(bytes.data()), bytes.size()}).string();
  const std::string cut =
      dir.write("b.pack", {reinterpret_cast<const char*>(bytes.data()), bytes.size() / 2}).string();
  alignas(16) unsigned char storage[PAL_PACK_STORAGE_BYTES];
  pal_pack* pack = nullptr;
  pal_status opened = PAL_STATUS_OK;
  pal_status refused = PAL_STATUS_OK;
  EXPECT_EQ(counted([&] {
              opened = pal_pack_open(file.c_str(), PAL_VERIFY_ONCE, storage, sizeof storage, &pack);
              pal_pack_close(pack);
              refused = pal_pack_open(cut.c_str(), PAL_VERIFY_ONCE, storage, sizeof storage, &pack);
            }),
            0);
  EXPECT_EQ(opened, PAL_STATUS_OK);
  EXPECT_EQ(refused, PAL_STATUS_TRUNCATED);
}

}  // namespace allocation_test
}  // namespace palpate::test
