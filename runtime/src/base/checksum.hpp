// XXH3, compiled once because its code is large.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace palpate {

// XXH3-64.
uint64_t digest_of_bytes(const void* bytes, size_t count);

// pack::checksum_of.
uint64_t checksum_of_file(const unsigned char* bytes, size_t count);

}  // namespace palpate
