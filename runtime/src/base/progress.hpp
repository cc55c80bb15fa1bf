// The state of work that its caller advances in slices. `goes_on`: call again.
#pragma once

#include <stdint.h>

namespace palpate {

enum class Progress : uint32_t { goes_on, ended, failed };

}  // namespace palpate
