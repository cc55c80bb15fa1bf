// Packs from arbitrary bytes, and sessions on packs, for the fuzz targets of the runtime.
#pragma once

#include <palpate/palpate.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <span>

#include "schemas/pack_checksum.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate::fuzz {

// Memory of exactly `size` bytes on a 64-byte boundary: AddressSanitizer sees an access of the next byte.
class Memory {
 public:
  explicit Memory(std::size_t size)
      : data_(static_cast<unsigned char*>(operator new(size, kAlign))), size_(size) {}
  unsigned char* data() const { return data_.get(); }
  std::size_t size() const { return size_; }

 private:
  static constexpr std::align_val_t kAlign{64};
  struct Release {
    void operator()(unsigned char* data) const { operator delete(data, kAlign); }
  };
  std::unique_ptr<unsigned char, Release> data_;
  std::size_t size_;
};

inline Memory copy_of(const std::uint8_t* data, std::size_t size) {
  Memory copy(size);
  if (size > 0) std::memcpy(copy.data(), data, size);
  return copy;
}

// A copy with the right size and checksum in its header: mutations then reach the checks of content.
inline Memory signed_pack(const std::uint8_t* data, std::size_t size) {
  Memory copy = copy_of(data, size);
  pack::PackHeader header;
  if (size < sizeof header) return copy;
  std::memcpy(&header, data, sizeof header);
  header.file_bytes = size;
  std::memcpy(copy.data(), &header, sizeof header);
  header.checksum = pack::checksum_of(copy.data(), size);
  std::memcpy(copy.data(), &header, sizeof header);
  return copy;
}

// The arena of a session with this config; of 0 bytes where the config is refused or wants more than 64 MiB.
inline Memory arena_for(const pal_pack* pack, const pal_session_config& config) {
  constexpr std::size_t kMostBytes = std::size_t{64} << 20;
  std::size_t bytes = 0;
  const pal_status status = pal_session_required_bytes(pack, &config, &bytes);
  return Memory(status == PAL_STATUS_OK && bytes <= kMostBytes ? bytes : 0);
}

// Ends the process where a number of an answer with status OK is not finite.
template <typename Real>
void require_finite(std::span<const Real> numbers) {
  if (!std::all_of(numbers.begin(), numbers.end(), [](Real number) { return std::isfinite(number); }))
    std::abort();
}

}  // namespace palpate::fuzz
