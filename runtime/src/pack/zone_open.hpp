// Reads the sizes and materials of nonlinear zones from a pack.
#pragma once

#include "runtime/src/pack/pack_view.hpp"
#include "schemas/pack_generated.h"

namespace palpate {

// False if the content is invalid. Call read_linear() first, because zones need the compliance.
bool read_zone(const pack::NonlinearZone& zone, uint64_t first_offset, pal_pack& pack);

}  // namespace palpate
