// Anderson's acceleration of a fixed-point iteration y <- G(y).
//
// With the residuals f = G(y) - y and the last differences dY, dF of successive y and f, at most
// kAccelerationDepth,
//
//   y_next = y + f - (dY + dF) gamma,    gamma = argmin |f - dF gamma|.
//
// If G is affine, and its matrix diagonalisable with m <= kAccelerationDepth distinct eigenvalues, none of
// them 1, the iteration reaches the fixed point in m + 1 calls unless the iteration stagnates. An
// eigenvalue's modulus may exceed 1, where plain iteration diverges.
//
// Source: Anderson 1965, J. ACM 12; Walker and Ni 2011, SIAM J. Numer. Anal. 49.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "runtime/src/base/arena.hpp"

namespace palpate {

inline constexpr uint32_t kAccelerationDepth = 5;

struct Acceleration {
  size_t size;            // length of y
  uint32_t count;         // differences held
  uint32_t next;          // column that the next difference overwrites
  bool has_last;          // last_y and last_f hold an iterate
  double* y_differences;  // [kAccelerationDepth][size] dY
  double* f_differences;  // [kAccelerationDepth][size] dF
  double* last_y;         // [size]
  double* last_f;         // [size]
};

void carve_acceleration(size_t size, Arena& arena, Acceleration& acceleration);

// Forgets all iterates. The caller restarts when G changes.
void restart_acceleration(Acceleration& acceleration);

// Replaces G(y) in `image` by y_next. The first call after a restart leaves G(y).
void accelerate(const double* y, double* image, Acceleration& acceleration);

}  // namespace palpate
