// A damaged compressed compliance with a repaired checksum: opening refuses the pack, or frames give finite
// numbers and read no byte past the end.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "schemas/pack_generated.h"
#include "tests/support/changed_pack.hpp"
#include "tests/support/compressed_pack.hpp"
#include "tests/support/runtime_session.hpp"
#include "tests/support/sanitizer.hpp"

namespace palpate::test {
namespace corrupt_compressed_test {

// Small, with blocks of every kind.
const AlignedBytes& good_bytes() {
  static const AlignedBytes bytes = [] {
    const TouchedSurface surface(6);
    const CompressedCompliance compressed =
        compress_linear_dd(surface.assembly, surface.block.sites, kComplianceTolerance);
    return surface.write(nullptr, &compressed);
  }();
  return bytes;
}

const pack::CompressedCompliance& good() {
  return *pack::GetPack(good_bytes().bytes().data() + sizeof(pack::PackHeader))->linear_dd()->compressed();
}

bool serves_finite_numbers(const pal_pack* pack) {
  pal_pack_info info = {};
  info.struct_size = sizeof info;
  require(pal_pack_get_info(pack, &info), "info");
  pal_session_config config = session_config(pack, PAL_MODEL_LINEAR, 3, 2);
  config.max_requested = 5;
  OwnedSession session(pack, config);
  bool finite = true;
  for (uint32_t frame = 0; frame < 12; ++frame) {
    const double reach[] = {0.3, 1, 1e8};
    const double d = info.max_displacement * reach[frame % 3];
    std::vector<pal_contact> contacts;
    for (uint32_t c = 0; c <= frame % 3; ++c)
      contacts.push_back(
          {(37 * frame + 11 * c) % info.num_sites, {0.5 * d, -0.3 * d, c == 1 ? 0.0 : -d}, 0, {}, {}, {}});
    if (frame == 9) session.fix({frame % info.num_contact_nodes, 0});
    for (const auto& result : session.touch(contacts)) finite = finite && all_finite(result);
    finite = finite && all_finite(session.field());
    const uint32_t asked[] = {0, 1, 33, info.num_nodes - 1};
    pal_real some[12];
    require(pal_session_request_nodes(session.get(), asked, 4), "request");
    require(pal_visual_frame(session.get(), some, kNodeBytes), "frame");
    for (const pal_real value : some) finite = finite && std::isfinite(value);
    require(pal_session_request_nodes(session.get(), nullptr, 0), "request");
  }
  return finite;
}

pal_status status_of(std::span<const unsigned char> bytes, pal_verify verify = PAL_VERIFY_ONCE) {
  alignas(16) unsigned char storage[PAL_PACK_STORAGE_BYTES];
  pal_pack* pack = nullptr;
  return pal_pack_open_memory(bytes.data(), bytes.size(), verify, storage, sizeof storage, &pack);
}

// Status after `change` to the array in `segment`.
template <typename T, typename Change>
pal_status status_with(const pack::Segment* segment, Change&& change, pal_verify verify = PAL_VERIFY_ONCE) {
  AlignedBytes copy = copy_of(good_bytes().bytes());
  change(reinterpret_cast<T*>(copy.bytes().data() + segment->offset()));
  repair_checksum(copy.bytes());
  return status_of(copy.bytes(), verify);
}

TEST(CorruptCompressed, WholeOneOpensAndServes) {
  EXPECT_EQ(status_of(good_bytes().bytes()), PAL_STATUS_OK);
  const OpenPack pack(good_bytes());
  EXPECT_TRUE(serves_finite_numbers(pack.get()));
}

TEST(CorruptCompressed, PlacesThatContradictThePanels) {
  const auto panels = [](auto&& change) {
    return status_with<pack::CompressedPanel>(good().panels(), change);
  };
  const uint32_t num_nodes = static_cast<uint32_t>(good().node_places()->bytes() / 4);
  EXPECT_EQ(panels([](pack::CompressedPanel*) {}), PAL_STATUS_OK);
  EXPECT_EQ(panels([](auto* p) { std::swap(p[0].nodes[0], p[0].nodes[1]); }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(panels([](auto* p) { p[0].nodes[0] = p[0].nodes[1]; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(panels([&](auto* p) { p[1].nodes[3] = num_nodes; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(panels([](auto* p) { p[0].nodes[4] = pack::kNoNode; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(panels([](auto* p) { ++p[1].first_column; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(panels([](auto* p) { p[0].num_columns = 97; }), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(panels([](auto* p) { p[0].num_columns = 0; }), PAL_STATUS_CORRUPT_CONTENT);
  for (const uint32_t place : {1U, 0xffffffffU, 0x7fffffffU})
    EXPECT_EQ(status_with<uint32_t>(good().node_places(), [&](uint32_t* places) { places[0] = place; }),
              PAL_STATUS_CORRUPT_CONTENT);
}

TEST(CorruptCompressed, BlocksThatPointElsewhere) {
  // PAL_VERIFY_NEVER skips the numbers; places of blocks are still checked.
  for (const pal_verify verify : {PAL_VERIFY_ONCE, PAL_VERIFY_NEVER}) {
    const auto blocks = [&](auto&& change) {
      return status_with<pack::CompressedBlock>(good().blocks(), change, verify);
    };
    const size_t count = good().blocks()->bytes() / sizeof(pack::CompressedBlock);
    const auto all = [&](auto&& change) {  // every tenth block in turn
      for (size_t at = 0; at < count; at += count / 10)
        EXPECT_EQ(blocks([&](pack::CompressedBlock* b) { change(b[at]); }), PAL_STATUS_CORRUPT_CONTENT) << at;
    };
    EXPECT_EQ(blocks([](pack::CompressedBlock*) {}), PAL_STATUS_OK);
    all([](pack::CompressedBlock& b) { b.start = 0xffffffff; });
    all([](pack::CompressedBlock& b) { b.start = 0xfffffff0; });
    all([](pack::CompressedBlock& b) { b.rank = 2; });
    all([](pack::CompressedBlock& b) { b.rank = 92; });
    all([](pack::CompressedBlock& b) { b.rank = 100; });
    all([](pack::CompressedBlock& b) { b.rank = 0xfffffffc; });
    EXPECT_EQ(blocks([](pack::CompressedBlock* b) {
                while (b->rank != pack::kPanelRows) ++b;
                ++b->start;  // not aligned to 64 bytes
              }),
              PAL_STATUS_CORRUPT_CONTENT);
    EXPECT_EQ(blocks([&](pack::CompressedBlock* b) {
                for (size_t i = 0; i < count; ++i) b[i].rank = 0;  // also the block of a panel with itself
              }),
              PAL_STATUS_CORRUPT_CONTENT);
  }
}

TEST(CorruptCompressed, NumbersBeyondTheirBounds) {
  const auto* blocks =
      reinterpret_cast<const pack::CompressedBlock*>(good_bytes().bytes().data() + good().blocks()->offset());
  const pack::CompressedBlock* near = blocks;
  while (near->rank != pack::kPanelRows) ++near;
  const pack::CompressedBlock* far = blocks;
  while (far->rank == pack::kPanelRows || far->rank == 0) ++far;
  for (const pal_real wrong : {std::nanf(""), HUGE_VALF, 1e30f, -1e5f}) {
    for (const pack::CompressedBlock* block : {near, far}) {
      EXPECT_EQ(
          status_with<pal_real>(good().coefficients(),
                                [&](pal_real* c) { c[size_t{block->start} * pack::kBlockUnit + 1] = wrong; }),
          PAL_STATUS_CORRUPT_CONTENT)
          << wrong;
    }
    EXPECT_EQ(status_with<pal_real>(good().basis(), [&](pal_real* b) { b[5] = wrong; }),
              PAL_STATUS_CORRUPT_CONTENT);
  }
  // The self-compliance of a node.
  const OpenPack pack(good_bytes());
  const auto own = [&](pal_real value) {
    return status_with<pal_real>(good().coefficients(), [&](pal_real* c) {
      const pack::CompressedBlock* block = blocks;  // block of contact node 0
      const uint32_t place = reinterpret_cast<const uint32_t*>(
          good_bytes().bytes().data() + good().node_places()->offset())[pack.face().info().num_nodes -
                                                                        pack.face().info().num_contact_nodes];
      const size_t row = size_t{3} * (place % pack::kPanelNodes);
      c[size_t{block[place / pack::kPanelNodes].start} * pack::kBlockUnit + row] = value;
    });
  };
  for (const pal_real value : {0.0f, -1.0f, 1e-30f})
    EXPECT_EQ(own(value), PAL_STATUS_CORRUPT_CONTENT) << value;
}

TEST(CorruptCompressed, StatedErrorsAreNumbers) {
  const TouchedSurface surface(3);
  CompressedCompliance compressed = compress_linear_dd(surface.assembly, surface.block.sites, 1e-3);
  const auto status = [&] { return status_of(surface.write(nullptr, &compressed).bytes()); };
  EXPECT_EQ(status(), PAL_STATUS_OK);
  for (double CompressedCompliance::*field :
       {&CompressedCompliance::tolerance, &CompressedCompliance::displacement_error,
        &CompressedCompliance::force_error}) {
    const double good_value = compressed.*field;
    for (const double wrong : {std::nan(""), -1.0, HUGE_VAL}) {
      compressed.*field = wrong;
      EXPECT_EQ(status(), PAL_STATUS_CORRUPT_CONTENT);
    }
    compressed.*field = good_value;
  }
  compressed.tolerance = 0.2;
  EXPECT_EQ(status(), PAL_STATUS_CORRUPT_CONTENT);
}

TEST(CorruptCompressed, MutatedSegmentsAreRefusedOrServed) {
  const auto original = good_bytes().bytes();
  std::mt19937_64 random(1);
  AlignedBytes copy = copy_of(original);
  int accepted = 0;
  for (const pack::Segment* segment :
       {good().panels(), good().node_places(), good().basis(), good().blocks(), good().coefficients()}) {
    for (int round = 0; round < (kSanitized ? 40 : 150); ++round) {
      const std::span<unsigned char> bytes = copy.bytes();
      memcpy(bytes.data(), original.data(), original.size());
      for (uint64_t mutations = 1 + random() % 3; mutations > 0; --mutations) {
        const size_t at = segment->offset() + random() % segment->bytes() / 4 * 4;
        const uint32_t values[] = {0,
                                   1,
                                   4,
                                   96,
                                   0x7f800000,
                                   0x7fc00000,
                                   0x00000001,
                                   0xff7fffff,
                                   0xffffffff,
                                   0x42c80000,
                                   0x3f800000,
                                   static_cast<uint32_t>(random() % 64),
                                   static_cast<uint32_t>(random())};
        const uint32_t value = values[random() % std::size(values)];
        if (random() % 3 == 0) {
          bytes[at] ^= static_cast<unsigned char>(1U << random() % 8);
        } else {
          memcpy(bytes.data() + at, &value, sizeof value);
        }
      }
      repair_checksum(bytes);
      alignas(16) unsigned char storage[PAL_PACK_STORAGE_BYTES];
      pal_pack* pack = nullptr;
      if (pal_pack_open_memory(bytes.data(), bytes.size(), PAL_VERIFY_ONCE, storage, sizeof storage, &pack) !=
          PAL_STATUS_OK)
        continue;
      ++accepted;
      ASSERT_TRUE(serves_finite_numbers(pack)) << round;
      pal_pack_close(pack);
    }
  }
  EXPECT_GT(accepted, 30);  // small changes of numbers; else frames were never reached
}

TEST(CorruptCompressed, ASessionLivesInTheBytesItAskedFor) {
  const OpenPack pack(good_bytes());
  pal_session_config config = session_config(pack.get(), PAL_MODEL_LINEAR, 2, 0);
  size_t without = 0;
  require(pal_session_required_bytes(pack.get(), &config, &without), "bytes");
  config.max_requested = pack.info().num_nodes;
  size_t with = 0;
  require(pal_session_required_bytes(pack.get(), &config, &with), "bytes");
  EXPECT_GE(with, without + size_t{8} * config.max_requested);  // the list, and the list in order of panels
}

}  // namespace corrupt_compressed_test
}  // namespace palpate::test
