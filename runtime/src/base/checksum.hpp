// XXH3, compiled once because its code is large.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace palpate {

// The XXH3-64 hash.
uint64_t digest_of_bytes(const void* bytes, size_t count);

// The checksum of a pack (schemas/pack_checksum.hpp).
uint64_t checksum_of_file(const unsigned char* bytes, size_t count);

}  // namespace palpate
