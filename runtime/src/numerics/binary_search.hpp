// Binary search.
#pragma once

#include <stdint.h>

namespace palpate {

// Returns the index i < count with value_of(i) == `value`, or `count` if none has. value_of must ascend.
template <typename Value, typename ValueOf>
uint32_t find_sorted(uint32_t count, Value value, ValueOf&& value_of) {
  uint32_t low = 0;
  uint32_t high = count;
  while (low < high) {
    const uint32_t middle = low + (high - low) / 2;
    if (value_of(middle) < value) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low < count && value_of(low) == value ? low : count;
}

}  // namespace palpate
