// The product of two vectors.
#pragma once

#include <stddef.h>

namespace palpate {

inline double product(const double* a, const double* b, size_t size) {
  double sums[4] = {};  // independent sums, so that no addition waits for another
  size_t i = 0;
  for (; i + 4 <= size; i += 4) {
    for (size_t k = 0; k < 4; ++k) sums[k] += a[i + k] * b[i + k];
  }
  for (; i < size; ++i) sums[0] += a[i] * b[i];
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

}  // namespace palpate
