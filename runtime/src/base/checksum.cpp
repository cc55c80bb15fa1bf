#include "runtime/src/base/checksum.hpp"

#include "schemas/pack_checksum.hpp"

namespace palpate {

uint64_t digest_of_bytes(const void* bytes, size_t count) {
  return XXH3_64bits(bytes, count);
}

uint64_t checksum_of_file(const unsigned char* bytes, size_t count) {
  return pack::checksum_of(bytes, count);
}

}  // namespace palpate
