#include "offline/io/vtu_array.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <new>
#include <utility>
#include <vector>

#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

using Take = std::function<void(std::string_view block)>;

constexpr std::size_t kPieceBytes = std::size_t{1} << 16;  // a multiple of the size of each number

int base64_digit(char letter) {
  if (letter >= 'A' && letter <= 'Z') return letter - 'A';
  if (letter >= 'a' && letter <= 'z') return letter - 'a' + 26;
  if (letter >= '0' && letter <= '9') return letter - '0' + 52;
  if (letter == '+') return 62;
  return letter == '/' ? 63 : -1;
}

// The stored bytes from front to back. Base64 may end its text with '=' and begin anew, as behind a header.
class StoredBytes {
 public:
  StoredBytes(std::string_view stored, bool is_base64, const VtuArrayPlace& place)
      : stored_(stored), is_base64_(is_base64), place_(place) {}

  std::size_t most_left() const {
    return decoded_.size() + (is_base64_ ? stored_.size() / 4 * 3 : stored_.size());
  }

  std::string next(std::size_t count) {
    if (count > most_left()) place_.fail("ends early; copy or export the file again");
    std::string bytes = std::move(decoded_);
    decoded_.clear();
    bytes.reserve(count + 3);
    if (!is_base64_) {
      bytes.append(stored_.substr(0, count));
      stored_.remove_prefix(count);
      return bytes;
    }
    while (bytes.size() < count) decode_group(bytes);
    decoded_ = bytes.substr(count);
    bytes.resize(count);
    return bytes;
  }

 private:
  char next_letter() {
    std::size_t at = 0;
    while (at < stored_.size() && static_cast<unsigned char>(stored_[at]) <= ' ') ++at;
    if (at == stored_.size()) place_.fail("ends early; copy or export the file again");
    const char letter = stored_[at];
    stored_.remove_prefix(at + 1);
    return letter;
  }

  // Four letters give three bytes; "==" at the end takes two bytes away.
  void decode_group(std::string& bytes) {
    std::uint32_t bits = 0;
    int num_padding = 0;
    for (int i = 0; i < 4; ++i) {
      const char letter = next_letter();
      const int digit = base64_digit(letter);
      const bool is_padding = letter == '=' && i >= 2;
      if ((digit < 0 && !is_padding) || (digit >= 0 && num_padding > 0))
        place_.fail("has a letter that is not base64; copy or export the file again");
      num_padding += is_padding ? 1 : 0;
      bits = bits << 6 | static_cast<std::uint32_t>(std::max(digit, 0));
    }
    for (int i = 0; i < 3 - num_padding; ++i) bytes += static_cast<char>(bits >> (16 - 8 * i) & 0xff);
  }

  std::string_view stored_;
  bool is_base64_;
  const VtuArrayPlace& place_;
  std::string decoded_;  // bytes of the last group that nobody has asked for
};

std::uint64_t next_header(StoredBytes& stored, const VtuCoding& coding) {
  const std::string bytes = stored.next(coding.header_bytes);
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const bool is_big = coding.numbers == NumberCoding::big_endian;
    number = number << 8 | static_cast<unsigned char>(bytes[is_big ? i : bytes.size() - 1 - i]);
  }
  return number;
}

// Unpacks the compressed blocks of an array into pieces of kPieceBytes.
class BlockInflater {
 public:
  BlockInflater(StoredBytes& stored, const Take& take) : stored_(stored), take_(take) {
    if (inflateInit(&stream_) != Z_OK) throw std::bad_alloc();
  }
  BlockInflater(const BlockInflater&) = delete;
  BlockInflater& operator=(const BlockInflater&) = delete;
  ~BlockInflater() { inflateEnd(&stream_); }

  // Unpacks the next block. Returns false if it is damaged, or has other than `size` bytes.
  bool inflate_block(std::uint64_t num_stored, std::uint64_t size) {
    inflateReset(&stream_);
    std::string from;
    stream_.avail_in = 0;
    int outcome = Z_OK;
    while (outcome == Z_OK) {
      if (stream_.avail_in == 0 && num_stored > 0) {
        from = stored_.next(std::min<std::uint64_t>(num_stored, kPieceBytes));
        num_stored -= from.size();
        stream_.next_in = reinterpret_cast<Bytef*>(from.data());
        stream_.avail_in = static_cast<uInt>(from.size());
      }
      // A byte more than the block should have shows a block that is too long.
      const auto room = static_cast<uInt>(std::min<std::uint64_t>(kPieceBytes - num_filled_, size + 1));
      stream_.next_out = piece_.data() + num_filled_;
      stream_.avail_out = room;
      outcome = inflate(&stream_, Z_NO_FLUSH);
      const uInt num_new = room - stream_.avail_out;
      if (num_new > size) return false;
      size -= num_new;
      num_filled_ += num_new;
      if (num_filled_ == kPieceBytes) flush();
    }
    return outcome == Z_STREAM_END && size == 0 && num_stored == 0 && stream_.avail_in == 0;
  }

  void flush() {
    take_({reinterpret_cast<const char*>(piece_.data()), num_filled_});
    num_filled_ = 0;
  }

 private:
  StoredBytes& stored_;
  const Take& take_;
  z_stream stream_ = {};
  std::array<Bytef, kPieceBytes> piece_;
  std::size_t num_filled_ = 0;
};

void inflate_blocks(StoredBytes& stored, const VtuCoding& coding, std::size_t num_bytes,
                    const VtuArrayPlace& place, const Take& take) {
  const std::uint64_t num_blocks = next_header(stored, coding);
  const std::uint64_t block_bytes = next_header(stored, coding);
  const std::uint64_t last_bytes = next_header(stored, coding);
  const std::uint64_t num_whole = last_bytes == 0 ? num_blocks : num_blocks - 1;
  const bool fits = num_blocks > 0 && num_blocks <= stored.most_left() / coding.header_bytes &&
                    last_bytes <= num_bytes && (block_bytes == 0 || num_whole <= num_bytes / block_bytes) &&
                    num_whole * block_bytes + last_bytes == num_bytes;
  if (!fits)
    place.fail(fmt::format("has blocks that do not make up its {} bytes; export the file again", num_bytes));
  std::vector<std::uint32_t> sizes(num_blocks);
  for (std::uint32_t& size : sizes) {
    const std::uint64_t stated = next_header(stored, coding);
    if (stated > stored.most_left()) place.fail("ends early; copy or export the file again");
    size = static_cast<std::uint32_t>(stated);
  }
  BlockInflater inflater(stored, take);
  for (std::uint64_t i = 0; i < num_blocks; ++i) {
    if (!inflater.inflate_block(sizes[i], i < num_whole ? block_bytes : last_bytes))
      place.fail(fmt::format("has a damaged compressed block {}; copy or export the file again", i + 1));
  }
  inflater.flush();
}

void take_growth(std::size_t num_bytes, std::size_t& growth_left, const VtuArrayPlace& place,
                 const std::string& remedy) {
  if (num_bytes > growth_left) place.fail("would grow far beyond the size of the file; " + remedy);
  growth_left -= num_bytes;
}

}  // namespace

void VtuArrayPlace::fail(const std::string& message) const {
  cursor.fail_at(line, "array '" + printable(name) + "' " + message);
}

void decode_vtu_array(std::string_view stored, bool is_base64, const VtuCoding& coding, std::size_t num_bytes,
                      std::size_t& growth_left, const VtuArrayPlace& place, const Take& take) {
  if (num_bytes == 0) return;
  StoredBytes bytes(stored, is_base64, place);
  if (coding.is_compressed) {
    take_growth(num_bytes, growth_left, place, "export the file without compression");
    return inflate_blocks(bytes, coding, num_bytes, place, take);
  }
  const std::uint64_t size = next_header(bytes, coding);
  if (size != num_bytes)
    place.fail(fmt::format("has {} bytes, where its values take {}; export the file again", size, num_bytes));
  if (num_bytes > bytes.most_left()) place.fail("ends early; copy or export the file again");
  take_growth(num_bytes, growth_left, place, "give each array an offset of its own");
  while (num_bytes > 0) {
    const std::string piece = bytes.next(std::min(num_bytes, kPieceBytes));
    num_bytes -= piece.size();
    take(piece);
  }
}

}  // namespace palpate
