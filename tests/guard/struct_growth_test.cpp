// struct_size lets old callers use a new library and new callers an old library.
#include <gtest/gtest.h>

#include <cstring>

#include "runtime/src/base/sized_struct.hpp"
#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"

namespace palpate::test {
namespace struct_growth_test {

// The struct of a caller that was compiled with a later header.
template <typename T>
struct Newer {
  T known;
  uint64_t unknown[2];
};

TEST(StructGrowth, ANewerCallerGetsZerosForWhatWeDoNotKnow) {
  const OpenPack pack(small_pack_bytes());
  Newer<pal_pack_info> info;
  std::memset(&info, 0xa5, sizeof info);
  info.known.struct_size = sizeof info;
  ASSERT_EQ(pal_pack_get_info(pack.get(), &info.known), PAL_STATUS_OK);
  EXPECT_EQ(info.known.num_nodes, pack.info().num_nodes);
  EXPECT_EQ(info.known.struct_size, sizeof info) << "the caller's own";
  EXPECT_EQ(info.unknown[0], 0U);
  EXPECT_EQ(info.unknown[1], 0U);
}

TEST(StructGrowth, ANewerCallersConfigServesWhileItAsksForNothingNew) {
  const OpenPack pack(small_pack_bytes());
  Newer<pal_session_config> config = {pal_default_session_config(pack.get()), {0, 0}};
  size_t known = 0;
  ASSERT_EQ(pal_session_required_bytes(pack.get(), &config.known, &known), PAL_STATUS_OK);
  config.known.struct_size = sizeof config;
  size_t bytes = 0;
  EXPECT_EQ(pal_session_required_bytes(pack.get(), &config.known, &bytes), PAL_STATUS_OK);
  EXPECT_EQ(bytes, known);
  config.unknown[1] = uint64_t{1} << 63;  // the very last byte
  EXPECT_EQ(pal_session_required_bytes(pack.get(), &config.known, &bytes), PAL_STATUS_BAD_STRUCT_SIZE);
}

// A struct that has grown, as a public struct may in a later release.
struct Grown {
  uint32_t struct_size;
  uint32_t first;
  uint32_t later;
};
constexpr uint32_t kFirstBytes = 8;

// noinline: the compiler must not see whose struct it is, as across the library's border.
[[gnu::noinline]] pal_status read(const Grown& from, Grown& to) {
  return read_sized(from, kFirstBytes, to);
}
[[gnu::noinline]] pal_status write(const Grown& from, Grown& to) {
  return write_sized(from, kFirstBytes, to);
}

TEST(StructGrowth, AnOlderCallerKeepsTheDefaultAndItsMemory) {
  const Grown given = {kFirstBytes, 7, 99};  // 99 lies beyond the caller's struct
  Grown config = {sizeof config, 1, 2};
  ASSERT_EQ(read(given, config), PAL_STATUS_OK);
  EXPECT_EQ(config.struct_size, sizeof config);
  EXPECT_EQ(config.first, 7U);
  EXPECT_EQ(config.later, 2U);

  Grown info = {kFirstBytes, 0, 99};
  ASSERT_EQ(write(Grown{sizeof info, 5, 6}, info), PAL_STATUS_OK);
  EXPECT_EQ(info.struct_size, kFirstBytes);
  EXPECT_EQ(info.first, 5U);
  EXPECT_EQ(info.later, 99U);
}

TEST(StructGrowth, SizesThatNobodyWroteAreRefused) {
  for (const uint32_t size : {0U, kFirstBytes - 1, kLargestStruct + 1, 0xffffffffU}) {
    const Grown given = {size, 7, 8};
    Grown config = {sizeof config, 1, 2};
    EXPECT_EQ(read(given, config), PAL_STATUS_BAD_STRUCT_SIZE) << size;
    EXPECT_EQ(config.first, 1U) << size;
    Grown info = {size, 3, 4};
    EXPECT_EQ(write(given, info), PAL_STATUS_BAD_STRUCT_SIZE) << size;
    EXPECT_EQ(info.first, 3U) << size;
  }
}

// Sizes in the first release. They must never change.
static_assert(sizeof(pal_pack_info) >= 88 && sizeof(pal_geometry) >= 40 && sizeof(pal_session_config) >= 16);

}  // namespace struct_growth_test
}  // namespace palpate::test
