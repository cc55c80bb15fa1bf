#include "runtime/src/calibration.hpp"

#include "runtime/src/linear_dd.hpp"

namespace palpate {
namespace {

constexpr uint32_t kRows = 45;
constexpr int kFactors = 16;  // timed together: clocks may be coarse
constexpr int kRounds = 9;
constexpr double kLeast = 1e-11;

// 8 on the diagonal, 1 / (1 + |i - j|) off it.
void fill(double* matrix) {
  for (uint32_t i = 0; i < kRows; ++i) {
    for (uint32_t j = 0; j < kRows; ++j) {
      const uint32_t apart = i > j ? i - j : j - i;
      matrix[i * kRows + j] = apart == 0 ? 8.0 : 1.0 / (1.0 + apart);
    }
  }
}

}  // namespace

double seconds_per_operation(pal_clock clock, void* user) {
  double rounds[kRounds];  // ascending
  for (int round = 0; round < kRounds; ++round) {
    double matrix[kRows * kRows];
    const uint64_t start = clock(user);
    for (int i = 0; i < kFactors; ++i) {
      fill(matrix);
      factor_for_calibration(matrix, kRows);
    }
    const uint64_t stop = clock(user);
    const double seconds = stop > start ? 1e-9 * static_cast<double>(stop - start) : 0.0;
    int place = round;
    for (; place > 0 && rounds[place - 1] > seconds; --place) rounds[place] = rounds[place - 1];
    rounds[place] = seconds;
  }
  const double operations = kFactors * (kRows * (kRows + 1.0) * (2.0 * kRows + 1.0) / 12.0);
  const double each = rounds[kRounds / 2] / operations;
  return each > kLeast ? each : kLeast;
}

}  // namespace palpate
