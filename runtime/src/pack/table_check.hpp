// FlatBuffers' verifier in its own file, because its code is long and runs once.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace palpate {

// Whether all tables of a pack lie within these bytes.
bool are_sound_tables(const unsigned char* bytes, uint64_t count);

}  // namespace palpate
