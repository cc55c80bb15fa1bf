#include "runtime/src/exterior/acceleration.hpp"

#include <math.h>

#include <algorithm>

#include "runtime/src/numerics/product.hpp"

namespace palpate {
namespace {

// Solves dF^T dF gamma = dF^T f by a Cholesky factor. A column of dF that depends to rounding on columns
// of lower index gets gamma = 0.
void find_weights(const Acceleration& acceleration, const double* f, double* gamma) {
  // A column is dependent if at most this part of its square remains after subtraction of its projection on
  // the columns of lower index.
  constexpr double kDependent = 1e-12;
  const uint32_t count = acceleration.count;
  double factor[kAccelerationDepth][kAccelerationDepth] = {};
  bool is_used[kAccelerationDepth] = {};
  const auto column = [&](uint32_t i) { return acceleration.f_differences + i * acceleration.size; };
  for (uint32_t i = 0; i < count; ++i) {
    for (uint32_t j = 0; j <= i; ++j) {
      if (j < i && !is_used[j]) continue;
      double entry = product(column(i), column(j), acceleration.size);
      const double square = entry;
      for (uint32_t k = 0; k < j; ++k) entry -= factor[i][k] * factor[j][k];
      if (j < i) {
        factor[i][j] = entry / factor[j][j];
      } else {
        is_used[i] = entry > kDependent * square;
        factor[i][i] = is_used[i] ? sqrt(entry) : 1;
      }
    }
    if (!is_used[i]) std::fill_n(factor[i], i, 0.0);
  }
  for (uint32_t i = 0; i < count; ++i) {
    gamma[i] = is_used[i] ? product(column(i), f, acceleration.size) : 0;
    for (uint32_t k = 0; k < i; ++k) gamma[i] -= factor[i][k] * gamma[k];
    gamma[i] /= factor[i][i];
  }
  for (uint32_t i = count; i-- > 0;) {
    for (uint32_t k = i + 1; k < count; ++k) gamma[i] -= factor[k][i] * gamma[k];
    gamma[i] = is_used[i] ? gamma[i] / factor[i][i] : 0;
  }
}

}  // namespace

void carve_acceleration(size_t size, Arena& arena, Acceleration& acceleration) {
  acceleration = {};
  acceleration.size = size;
  acceleration.y_differences = arena.take<double>(kAccelerationDepth * size);
  acceleration.f_differences = arena.take<double>(kAccelerationDepth * size);
  acceleration.last_y = arena.take<double>(size);
  acceleration.last_f = arena.take<double>(size);
}

void restart_acceleration(Acceleration& acceleration) {
  acceleration.count = acceleration.next = 0;
  acceleration.has_last = false;
}

void accelerate(const double* y, double* image, Acceleration& acceleration) {
  const size_t size = acceleration.size;
  double* y_difference = acceleration.y_differences + acceleration.next * size;
  double* f_difference = acceleration.f_differences + acceleration.next * size;
  for (size_t i = 0; i < size; ++i) {
    const double f = image[i] - y[i];
    if (acceleration.has_last) {
      y_difference[i] = y[i] - acceleration.last_y[i];
      f_difference[i] = f - acceleration.last_f[i];
    }
    acceleration.last_y[i] = y[i];
    acceleration.last_f[i] = f;
  }
  if (!acceleration.has_last) {
    acceleration.has_last = true;
    return;
  }
  acceleration.next = (acceleration.next + 1) % kAccelerationDepth;
  acceleration.count = std::min(acceleration.count + 1, kAccelerationDepth);
  double gamma[kAccelerationDepth];
  find_weights(acceleration, acceleration.last_f, gamma);
  for (uint32_t k = 0; k < acceleration.count; ++k) {
    if (gamma[k] == 0) continue;
    const double* dy = acceleration.y_differences + k * size;
    const double* df = acceleration.f_differences + k * size;
    for (size_t i = 0; i < size; ++i) image[i] -= gamma[k] * (dy[i] + df[i]);
  }
}

}  // namespace palpate
