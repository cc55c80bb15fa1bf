#include "runtime/src/numerics/semidefinite_cholesky.hpp"

#include <math.h>
#include <stddef.h>

namespace palpate {

bool factor_semidefinite(uint32_t count, double least_part, double* factor) {
  bool is_definite = true;
  for (uint32_t k = 0; k < count; ++k) {
    double* row = factor + size_t{k} * count;
    const double diagonal = row[k];
    for (uint32_t i = 0; i < k; ++i) {
      const double* above = factor + size_t{i} * count;
      for (uint32_t j = k; j < count; ++j) row[j] -= above[k] * above[j];
    }
    if (!(row[k] > least_part * diagonal)) {
      is_definite = false;
      for (uint32_t j = k; j < count; ++j) row[j] = 0;
      continue;
    }
    const double inverse = 1.0 / sqrt(row[k]);
    for (uint32_t j = k; j < count; ++j) row[j] *= inverse;
  }
  return is_definite;
}

void solve_semidefinite(const double* factor, uint32_t count, double* x) {
  for (uint32_t k = 0; k < count; ++k) {
    const double* row = factor + size_t{k} * count;
    x[k] = row[k] > 0 ? x[k] / row[k] : 0.0;
    for (uint32_t j = k + 1; j < count; ++j) x[j] -= row[j] * x[k];
  }
  for (uint32_t k = count; k-- > 0;) {
    const double* row = factor + size_t{k} * count;
    double sum = x[k];
    for (uint32_t j = k + 1; j < count; ++j) sum -= row[j] * x[j];
    x[k] = row[k] > 0 ? sum / row[k] : 0.0;
  }
}

}  // namespace palpate
