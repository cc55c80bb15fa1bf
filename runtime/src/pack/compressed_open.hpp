// Opening a compressed compliance: everything that compressed_compliance.cpp relies on.
#pragma once

#include <palpate/palpate.h>

#include "schemas/pack_generated.h"

namespace palpate {

// Sets the views of `pack`, whose geometry and sites have been read. False where something is missing, points
// outside its array or says a number from which a frame could make one that is not finite. Cost, unless
// trusted: every displacement for every contact node is made once.
bool read_compressed(const pack::CompressedCompliance& compressed, uint64_t first_offset, bool trusted,
                     pal_pack& pack);

}  // namespace palpate
