// Reads the organ's mesh and elimination tree from a pack.
#pragma once

#include "runtime/src/pack/pack_view.hpp"
#include "schemas/pack_generated.h"

namespace palpate {

// Sets pal_pack::organ. False if the content is invalid. Call read_zone() first: elements name its materials.
bool read_organ(const pack::Organ& organ, uint64_t first_offset, pal_pack& pack);

}  // namespace palpate
