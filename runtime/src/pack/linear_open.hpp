// Opens the compliance of linear_dd, and the response to gravity.
#pragma once

#include "runtime/src/pack/pack_view.hpp"
#include "schemas/pack_generated.h"

namespace palpate {

// Sets the views of the compliance and of the sites' nodal forces. Needs the contact sites. `trusted`:
// PAL_VERIFY_NEVER.
bool read_linear(const pack::LinearDd& linear, uint64_t first_offset, bool trusted, pal_pack& pack);

// Sets the views of gravity. Needs the contact sites. `trusted`: PAL_VERIFY_NEVER.
bool read_gravity(const pack::Gravity& gravity, uint64_t first_offset, bool trusted, pal_pack& pack);

}  // namespace palpate
