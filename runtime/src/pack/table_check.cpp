#include "runtime/src/pack/table_check.hpp"

#include "schemas/pack_generated.h"

namespace palpate {

bool are_sound_tables(const unsigned char* bytes, uint64_t count) {
  constexpr uint64_t kLeast = 16;
  flatbuffers::Verifier verifier(bytes, count);
  return count >= kLeast && pack::VerifyPackBuffer(verifier);
}

}  // namespace palpate
