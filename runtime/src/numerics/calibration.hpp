// Measures the time of one multiply-add in the dense inverse of a new contact set.
#pragma once

#include <palpate/palpate.h>

namespace palpate {

// Returns the median of several timings, with matrices of three contacts of five nodes each. The call takes
// about a millisecond. A clock that stands still gives the smallest plausible time, 1e-12 s.
double seconds_per_operation(pal_clock clock, void* user);

}  // namespace palpate
