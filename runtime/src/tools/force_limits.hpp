// The limits of tools' forces where a config states none.
//
//   F = max over sites of max_displacement |K|,   K = d force / d displacement of the site's patch at rest, alone
//   max_force = 5 F,   max_force_rate = max_force / 10 ms
//
// A pack does not keep the largest force of its survey, only a scale of at least 5 % of it. F is known of every pack, but
// leaves out that tissue stiffens and that a tool may hold several sites: hence the factor.
#pragma once

#include <palpate/palpate.h>

namespace palpate {

// Replaces the limits that are 0.
void fill_limits(const pal_pack& pack, pal_session_config& config);

}  // namespace palpate
