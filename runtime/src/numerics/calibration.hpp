// How long this processor takes for one multiply-add of the dense inverses that a new contact set needs.
#pragma once

#include <palpate/palpate.h>

namespace palpate {

// The median over several changes of the size that three contacts with patches of five nodes have. Takes
// about a millisecond. A clock that stands still gives the smallest time that is believed, 1e-12 s.
double seconds_per_operation(pal_clock clock, void* user);

}  // namespace palpate
