// FlatBuffers' own verifier, on its own: it is long code that runs once over a few kilobytes.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace palpate {

// Whether the tables of a pack can be read without leaving these bytes.
bool are_sound_tables(const unsigned char* bytes, uint64_t count);

}  // namespace palpate
