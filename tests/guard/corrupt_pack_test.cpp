// Opening refuses damaged packs with the status that names the damage, and reads no byte past the end. Each
// pack lies in memory of exactly its size, so AddressSanitizer sees an overrun.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <random>
#include <set>
#include <string>

#include "schemas/pack_generated.h"
#include "tests/support/changed_pack.hpp"
#include "tests/support/runtime_session.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/small_pack.hpp"

namespace palpate::test {
namespace corrupt_pack_test {

pal_status file_status(const std::filesystem::path& file) {
  alignas(16) unsigned char storage[PAL_PACK_STORAGE_BYTES];
  pal_pack* pack = nullptr;
  const pal_status status = pal_pack_open(file.c_str(), PAL_VERIFY_ONCE, storage, sizeof storage, &pack);
  EXPECT_EQ(pack == nullptr, status != PAL_STATUS_OK);
  pal_pack_close(pack);
  return status;
}

std::string_view as_text(std::span<const unsigned char> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Status after `change` to a copy of the small pack.
template <typename Change>
pal_status status_after(Change&& change) {
  AlignedBytes copy = copy_of(small_pack_bytes().bytes());
  change(copy.bytes());
  return open_status(copy.bytes());
}

template <typename Change>
pal_status status_after_header(Change&& change, bool repair) {
  return status_after([&](std::span<unsigned char> bytes) {
    pack::PackHeader header = header_of(bytes);
    change(header);
    set_header(bytes, header);
    if (repair) repair_checksum(bytes);
  });
}

TEST(CorruptPack, WholeOneOpens) {
  EXPECT_EQ(open_status(small_pack_bytes().bytes()), PAL_STATUS_OK);
  EXPECT_EQ(status_after([](auto bytes) { repair_checksum(bytes); }), PAL_STATUS_OK);
}

TEST(CorruptPack, EveryTruncationIsRefused) {
  const auto bytes = small_pack_bytes().bytes();
  std::set<size_t> lengths;
  for (size_t length = 0; length <= 256; ++length) lengths.insert(length);
  for (size_t length = 0; length < bytes.size(); length += 997) lengths.insert(length);
  for (size_t cut = 1; cut <= 130; ++cut) lengths.insert(bytes.size() - cut);
  for (const size_t length : lengths) {
    AlignedBytes cut = copy_of(bytes.first(length));
    const bool has_header = length >= sizeof(pack::PackHeader);
    EXPECT_EQ(open_status(cut.bytes()), has_header ? PAL_STATUS_TRUNCATED : PAL_STATUS_NOT_A_PACK) << length;
    if (!has_header) continue;
    // The header claims the shorter length. The tables or segments do not fit, or the checksum differs.
    pack::PackHeader header = header_of(cut.bytes());
    header.file_bytes = length;
    set_header(cut.bytes(), header);
    EXPECT_NE(open_status(cut.bytes()), PAL_STATUS_OK) << length;
    repair_checksum(cut.bytes());
    const pal_status status = open_status(cut.bytes());
    if (bytes.size() - length < pack::kAlignment) continue;  // the cut may have removed only padding
    EXPECT_TRUE(status == PAL_STATUS_CORRUPT_TABLES || status == PAL_STATUS_CORRUPT_CONTENT)
        << length << ": " << pal_status_text(status);
  }
}

TEST(CorruptPack, AddedBytesAreRefused) {
  const auto bytes = small_pack_bytes().bytes();
  for (const size_t added : {size_t{1}, size_t{64}, size_t{5000}}) {
    AlignedBytes longer(bytes.size() + added);
    std::memcpy(longer.bytes().data(), bytes.data(), bytes.size());
    EXPECT_EQ(open_status(longer.bytes()), PAL_STATUS_TRUNCATED);
  }
}

TEST(CorruptPack, EverySingleBitOfHeaderAndTablesCounts) {
  AlignedBytes copy = copy_of(small_pack_bytes().bytes());
  const std::span<unsigned char> bytes = copy.bytes();
  const pack::PackHeader header = header_of(bytes);
  const size_t end = header.tables_offset + header.tables_bytes;
  const size_t step = kSanitized ? 7 : 1;  // instrumented code is slow
  std::map<pal_status, int> statuses;
  for (size_t bit = 0; bit < 8 * end; bit += bit < 8 * sizeof header ? 1 : step) {
    const size_t byte = bit / 8;
    const auto mask = static_cast<unsigned char>(1U << (bit % 8));
    bytes[byte] ^= mask;
    const pal_status status = open_status(bytes);
    bytes[byte] ^= mask;
    ++statuses[status];
    ASSERT_NE(status, PAL_STATUS_OK) << "bit " << bit;
    pal_status expected = status;
    if (byte < 8) {
      expected = PAL_STATUS_NOT_A_PACK;
    } else if (byte < 16) {
      expected = PAL_STATUS_WRONG_VERSION;
    } else if (byte < 24) {
      expected = PAL_STATUS_CORRUPT_TABLES;
    } else if (byte >= 32 && byte < 40) {
      expected = PAL_STATUS_TRUNCATED;
    } else if (byte >= 40 && byte < 64) {
      expected = PAL_STATUS_BAD_CHECKSUM;
    } else {
      EXPECT_TRUE(status == PAL_STATUS_CORRUPT_TABLES || status == PAL_STATUS_CORRUPT_CONTENT ||
                  status == PAL_STATUS_OTHER_PRECISION || status == PAL_STATUS_BAD_CHECKSUM)
          << "bit " << bit << ": " << pal_status_text(status);
    }
    EXPECT_EQ(status, expected) << "bit " << bit;
  }
  EXPECT_EQ(open_status(bytes), PAL_STATUS_OK);  // the last round restored every bit
  // All three layers of the check refused some packs.
  EXPECT_GT(statuses[PAL_STATUS_CORRUPT_TABLES], 10);
  EXPECT_GT(statuses[PAL_STATUS_CORRUPT_CONTENT], 10);
  EXPECT_GT(statuses[PAL_STATUS_BAD_CHECKSUM], 10);
}

TEST(CorruptPack, RandomBitsOfSegmentsAndPaddingCount) {
  AlignedBytes copy = copy_of(small_pack_bytes().bytes());
  const std::span<unsigned char> bytes = copy.bytes();
  const pack::PackHeader header = header_of(bytes);
  std::mt19937_64 random(1);
  std::uniform_int_distribution<size_t> any_bit(8 * (header.tables_offset + header.tables_bytes),
                                                8 * bytes.size() - 1);
  for (int i = 0; i < (kSanitized ? 300 : 2000); ++i) {
    const size_t bit = any_bit(random);
    bytes[bit / 8] ^= static_cast<unsigned char>(1U << (bit % 8));
    const pal_status status = open_status(bytes);
    bytes[bit / 8] ^= static_cast<unsigned char>(1U << (bit % 8));
    EXPECT_TRUE(status == PAL_STATUS_CORRUPT_CONTENT || status == PAL_STATUS_BAD_CHECKSUM)
        << "bit " << bit << ": " << pal_status_text(status);
  }
}

TEST(CorruptPack, OtherVersionsAreRefusedAsSuch) {
  for (const uint32_t version : {0u, pack::kFormatVersion - 1, pack::kFormatVersion + 1, 0xffffffffu}) {
    EXPECT_EQ(status_after_header([&](pack::PackHeader& header) { header.format_version = version; }, true),
              PAL_STATUS_WRONG_VERSION);
  }
  EXPECT_EQ(status_after_header([](pack::PackHeader& header) { header.header_bytes = 128; }, true),
            PAL_STATUS_WRONG_VERSION);
}

TEST(CorruptPack, HeaderThatLiesAboutTheTables) {
  const auto tables = [](uint64_t offset, uint64_t bytes) {
    return status_after_header(
        [&](pack::PackHeader& header) {
          header.tables_offset = offset;
          header.tables_bytes = bytes;
        },
        true);
  };
  const pack::PackHeader header = header_of(small_pack_bytes().bytes());
  EXPECT_EQ(tables(64, header.tables_bytes), PAL_STATUS_OK);
  EXPECT_EQ(tables(0, header.tables_bytes), PAL_STATUS_CORRUPT_TABLES);
  EXPECT_EQ(tables(128, header.tables_bytes), PAL_STATUS_CORRUPT_TABLES);
  EXPECT_EQ(tables(~uint64_t{0}, header.tables_bytes), PAL_STATUS_CORRUPT_TABLES);
  EXPECT_EQ(tables(64, ~uint64_t{0}), PAL_STATUS_CORRUPT_TABLES);
  EXPECT_EQ(tables(64, header.file_bytes), PAL_STATUS_CORRUPT_TABLES);
  for (const uint64_t bytes : {0u, 1u, 4u, 8u, 15u, 16u, 17u})
    EXPECT_EQ(tables(64, bytes), PAL_STATUS_CORRUPT_TABLES);
  // Tables that overlap the segments.
  EXPECT_EQ(tables(64, header.file_bytes - 64), PAL_STATUS_CORRUPT_CONTENT);
}

TEST(CorruptPack, FilesThatAreNoPacks) {
  const TempDir dir;
  const auto bytes = small_pack_bytes().bytes();
  EXPECT_EQ(file_status(dir.write("good.pack", as_text(bytes))), PAL_STATUS_OK);
  EXPECT_EQ(file_status(dir.write("empty.pack", "")), PAL_STATUS_NOT_A_PACK);
  EXPECT_EQ(file_status(dir.write("text.pack", std::string(5000, 'x'))), PAL_STATUS_NOT_A_PACK);
  EXPECT_EQ(file_status(dir.write("short.pack", "PALPATE")), PAL_STATUS_NOT_A_PACK);
  EXPECT_EQ(file_status(dir.write("cut.pack", as_text(bytes.first(bytes.size() / 2)))), PAL_STATUS_TRUNCATED);
  EXPECT_EQ(file_status(dir.path() / "missing.pack"), PAL_STATUS_FILE_NOT_FOUND);
  EXPECT_EQ(file_status(dir.path()), PAL_STATUS_FILE_NOT_READABLE);   // a directory
  EXPECT_EQ(file_status("/dev/null"), PAL_STATUS_FILE_NOT_READABLE);  // a device
  EXPECT_EQ(file_status(dir.path() / "good.pack" / "x"),
            PAL_STATUS_FILE_NOT_READABLE);  // a file in place of a folder
  EXPECT_EQ(file_status(""), PAL_STATUS_FILE_NOT_FOUND);
}

TEST(CorruptPack, FilesThatCannotBeRead) {
  const TempDir dir;
  const auto file = dir.write("locked.pack", as_text(small_pack_bytes().bytes()));
  ASSERT_EQ(chmod(file.c_str(), 0), 0);
  if (geteuid() != 0) {  // the superuser may read any file
    EXPECT_EQ(file_status(file), PAL_STATUS_FILE_NOT_READABLE);
  }
  // open() fails on a socket.
  sockaddr_un address = {};
  address.sun_family = AF_UNIX;
  const std::string path = (dir.path() / "s").string();
  ASSERT_LT(path.size(), sizeof address.sun_path);
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  const int handle = socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(bind(handle, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  EXPECT_EQ(file_status(path), PAL_STATUS_FILE_NOT_READABLE);
  close(handle);
}

// A pipe without a writer: opening must refuse at once and not wait for a writer.
TEST(CorruptPack, PipeDoesNotBlock) {
  const TempDir dir;
  const std::string path = (dir.path() / "pipe").string();
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  alarm(20);  // ends the test if opening waits
  EXPECT_EQ(file_status(path), PAL_STATUS_FILE_NOT_READABLE);
  alarm(0);
}

// PAL_VERIFY_NEVER skips numbers; sizes and indices that a frame follows are still checked.
TEST(CorruptPack, TrustGoesToNumbersOnly) {
  const auto good = small_pack_bytes().bytes();
  const auto status_of = [](std::span<const unsigned char> bytes, pal_verify verify) {
    alignas(16) unsigned char storage[PAL_PACK_STORAGE_BYTES];
    pal_pack* pack = nullptr;
    return pal_pack_open_memory(bytes.data(), bytes.size(), verify, storage, sizeof storage, &pack);
  };
  EXPECT_EQ(status_of(good, PAL_VERIFY_NEVER), PAL_STATUS_OK);
  const pack::Pack& tables = *pack::GetPack(good.data() + sizeof(pack::PackHeader));
  AlignedBytes changed = copy_of(good);
  const double not_a_number = std::nan("");
  memcpy(changed.bytes().data() + tables.polynomial_dd()->energy()->offset(), &not_a_number, 8);
  memcpy(changed.bytes().data() + tables.polynomial_dd()->coefficients()->offset(), &not_a_number, 8);
  memcpy(changed.bytes().data() + tables.polynomial_dd()->field()->offset(), &not_a_number, 8);
  memcpy(changed.bytes().data() + tables.linear_dd()->contact_compliance()->offset(), &not_a_number, 8);
  EXPECT_EQ(status_of(changed.bytes(), PAL_VERIFY_NEVER), PAL_STATUS_OK);
  EXPECT_EQ(status_of(changed.bytes(), PAL_VERIFY_ONCE), PAL_STATUS_CORRUPT_CONTENT);
  changed = copy_of(good);
  changed.bytes()[changed.bytes().size() - 1] ^= 1;  // padding
  EXPECT_EQ(status_of(changed.bytes(), PAL_VERIFY_NEVER), PAL_STATUS_OK);
  EXPECT_EQ(status_of(changed.bytes(), PAL_VERIFY_ONCE), PAL_STATUS_BAD_CHECKSUM);
  changed = copy_of(good);
  const uint32_t far = 0xffffff;
  memcpy(changed.bytes().data() + tables.sites()->patch_nodes()->offset(), &far, 4);
  EXPECT_EQ(status_of(changed.bytes(), PAL_VERIFY_NEVER), PAL_STATUS_CORRUPT_CONTENT);
  changed = copy_of(good);
  const size_t rank = tables.polynomial_dd()->sites()->offset() + offsetof(pack::PolynomialSite, rank);
  memcpy(changed.bytes().data() + rank, &far, 4);
  EXPECT_EQ(status_of(changed.bytes(), PAL_VERIFY_NEVER), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_of(good.first(good.size() - 64), PAL_VERIFY_NEVER), PAL_STATUS_TRUNCATED);
}

TEST(CorruptPack, FieldsOfAnotherPrecisionAreRefused) {
  const auto status_with_bytes = [](uint8_t count) {
    AlignedBytes copy = copy_of(small_pack_bytes().bytes());
    unsigned char* tables = copy.bytes().data() + header_of(copy.bytes()).tables_offset;
    unsigned char* real_bytes =
        flatbuffers::GetMutableRoot<flatbuffers::Table>(tables)->GetAddressOf(pack::Pack::VT_REAL_BYTES);
    if (real_bytes == nullptr) throw std::runtime_error("not in the tables");
    *real_bytes = count;
    repair_checksum(copy.bytes());
    return open_status(copy.bytes());
  };
  for (const uint8_t count : {uint8_t{4}, uint8_t{8}}) {
    EXPECT_EQ(status_with_bytes(count),
              count == sizeof(pal_real) ? PAL_STATUS_OK : PAL_STATUS_OTHER_PRECISION);
  }
  for (const uint8_t count : {uint8_t{0}, uint8_t{5}, uint8_t{255}})
    EXPECT_EQ(status_with_bytes(count), PAL_STATUS_CORRUPT_CONTENT);
}

TEST(CorruptPack, EveryStatusHasItsOwnText) {
  std::set<std::string> texts;
  int known = 0;
  const std::string unknown = pal_status_text(static_cast<pal_status>(1));
  for (int value = 0; value < 64; ++value) {
    const std::string text = pal_status_text(static_cast<pal_status>(value));
    if (text == unknown) continue;
    ++known;
    EXPECT_TRUE(texts.insert(text).second) << text;
    EXPECT_GT(text.size(), 5U);
    EXPECT_NE(text.back(), '.');
  }
  EXPECT_EQ(known, 28);  // the number that palpate.h pins
  for (const pal_status status : {PAL_STATUS_OK,
                                  PAL_STATUS_NULL_ARGUMENT,
                                  PAL_STATUS_BAD_STRUCT_SIZE,
                                  PAL_STATUS_BAD_ARGUMENT,
                                  PAL_STATUS_NOT_FINITE,
                                  PAL_STATUS_NO_SUCH_SITE,
                                  PAL_STATUS_NO_SUCH_NODE,
                                  PAL_STATUS_NO_SUCH_MODEL,
                                  PAL_STATUS_MODEL_CANNOT_ANSWER,
                                  PAL_STATUS_ARENA_TOO_SMALL,
                                  PAL_STATUS_ARENA_MISALIGNED,
                                  PAL_STATUS_CAPACITY_EXCEEDED,
                                  PAL_STATUS_FILE_NOT_FOUND,
                                  PAL_STATUS_FILE_NOT_READABLE,
                                  PAL_STATUS_NOT_A_PACK,
                                  PAL_STATUS_WRONG_VERSION,
                                  PAL_STATUS_TRUNCATED,
                                  PAL_STATUS_CORRUPT_TABLES,
                                  PAL_STATUS_CORRUPT_CONTENT,
                                  PAL_STATUS_BAD_CHECKSUM,
                                  PAL_STATUS_OTHER_PRECISION}) {
    EXPECT_NE(pal_status_text(status), unknown);
  }
}

}  // namespace corrupt_pack_test
}  // namespace palpate::test
