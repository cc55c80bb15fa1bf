// Reading the organ's mesh and elimination tree from a pack.
#pragma once

#include "runtime/src/pack/pack_view.hpp"
#include "schemas/pack_generated.h"

namespace palpate {

// Needs the nonlinear zones, whose materials the elements name, and whose nodes and elements are the organ's.
bool read_organ(const pack::Organ& organ, uint64_t first_offset, pal_pack& pack);

}  // namespace palpate
