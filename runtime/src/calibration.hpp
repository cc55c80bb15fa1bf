// How long this processor takes for one multiply-add of the dense factors that a new contact set needs.
#pragma once

#include <palpate/palpate.h>

namespace palpate {

// The median over several factors of the size that three contacts with patches of five nodes have. Takes
// about a millisecond. A clock that stands still gives the smallest time that is believed, 1e-11 s.
double seconds_per_operation(pal_clock clock, void* user);

}  // namespace palpate
