// Anderson's acceleration of a fixed-point iteration y <- G(y).
//
// With the residuals f = G(y) - y and the last `depth` differences dY, dF of successive y and f,
//
//   y_next = y + f - (dY + dF) gamma,    gamma = argmin |f - dF gamma|.
//
// A linear, diagonalisable G with m <= depth distinct eigenvalues, none of them 1, converges in m + 1 iterations
// unless it stagnates, also where the modulus of an eigenvalue exceeds 1 and plain iteration would diverge.
//
// Source: Anderson 1965, J. ACM 12; Walker and Ni 2011, SIAM J. Numer. Anal. 49.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "runtime/src/base/arena.hpp"

namespace palpate {

inline constexpr uint32_t kMostAccelerated = 5;  // depth

struct Acceleration {
  size_t size;      // of y
  uint32_t count;   // differences held
  uint32_t next;    // column that the next difference overwrites
  bool has_last;    // last_y and last_f hold an iterate
  double* moves;    // [kMostAccelerated][size] dY
  double* changes;  // [kMostAccelerated][size] dF
  double* last_y;   // [size]
  double* last_f;   // [size]
};

void carve_acceleration(size_t size, Arena& arena, Acceleration& acceleration);

// Forgets all iterates: G has changed.
void restart_acceleration(Acceleration& acceleration);

// In: y, and G(y) in `image`. Out: the next y in `image`.
void accelerate(const double* y, double* image, Acceleration& acceleration);

}  // namespace palpate
