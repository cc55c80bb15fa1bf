// Work that is done in slices.
#pragma once

#include <stdint.h>

namespace palpate {

enum class Progress : uint32_t { goes_on, ended, failed };

}  // namespace palpate
