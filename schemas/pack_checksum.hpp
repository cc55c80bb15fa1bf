// The checksum of a pack file: XXH3-64 of all bytes after the header. The seed is XXH3-64 of the header with
// a zero checksum. This checksum is part of the format.
#pragma once

#include <string.h>

#ifndef XXH_INLINE_ALL
#define XXH_INLINE_ALL
#endif
#include <xxhash.h>

#include "schemas/pack_layout.hpp"

namespace palpate::pack {

// `num_bytes` is at least sizeof(PackHeader).
inline uint64_t checksum_of(const unsigned char* bytes, size_t num_bytes) {
  PackHeader header;
  memcpy(&header, bytes, sizeof header);
  header.checksum = 0;
  const uint64_t seed = XXH3_64bits(&header, sizeof header);
  return XXH3_64bits_withSeed(bytes + sizeof header, num_bytes - sizeof header, seed);
}

}  // namespace palpate::pack
