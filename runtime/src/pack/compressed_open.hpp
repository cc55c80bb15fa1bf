// Opens a compressed compliance, and checks every assumption of compressed_compliance.cpp.
#pragma once

#include <palpate/palpate.h>

#include "schemas/pack_generated.h"

namespace palpate {

// Sets the views of `pack`, whose geometry and sites are ready. Unless trusted, the function computes every
// displacement for every contact node once. False in three cases:
// - An array is missing.
// - An index or offset points outside its array.
// - A number could make a frame's result non-finite.
bool read_compressed(const pack::CompressedCompliance& compressed, uint64_t first_offset, bool trusted,
                     pal_pack& pack);

}  // namespace palpate
