// The limits of tools' forces where a config states none.
//
//   F = max over sites of max_displacement |K|,   K = d force / d displacement of the site's patch at rest, alone
//   max_force = 5 F,   max_force_rate = max_force / 10 ms
//
// A pack does not keep the largest force of its survey. F is the part of that force that every pack tells: it leaves out
// that tissue stiffens. Hence the factor: within max_displacement tissue stiffens two to three times, and a tool may
// hold several sites.
#pragma once

#include <palpate/palpate.h>

namespace palpate {

// Replaces the limits that are 0.
void fill_limits(const pal_pack& pack, pal_session_config& config);

}  // namespace palpate
