// The default limits of tool forces, for a config that states none.
//
//    F = max over sites of max_displacement |K|,   K = d force / d displacement of one patch, alone at rest
//    max_force = 5 F,   max_force_rate = max_force / 10 ms
//
// A pack does not keep the largest force of its survey, and F leaves out the stiffening of the tissue. The
// factor 5 covers this stiffening within max_displacement, and tools that hold several sites.
#pragma once

#include <palpate/palpate.h>

namespace palpate {

// Replaces each limit that is 0 by its default.
void fill_limits(const pal_pack& pack, pal_session_config& config);

}  // namespace palpate
