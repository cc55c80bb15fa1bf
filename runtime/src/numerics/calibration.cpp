#include "runtime/src/numerics/calibration.hpp"

#include "runtime/src/numerics/inverse_kernel.hpp"

namespace palpate {
namespace {

constexpr uint32_t kNodes = 15;
constexpr size_t kStride = 48;  // 3 kNodes, rounded up
static_assert(kStride >= 3 * kNodes && kStride % kInverseLanes == 0);
constexpr int kProducts = 64;  // products in one timing, for a coarse clock
constexpr int kRounds = 9;
constexpr double kLeastSeconds = 1e-12;

}  // namespace

double seconds_per_operation(pal_clock clock, void* user) {
  const InverseKernel kernel = choose_inverse_kernel();
  alignas(64) double matrix[3 * kNodes * kStride];
  alignas(64) double columns[3 * kStride];
  alignas(64) double products[3 * kStride];
  // The matrix is a contraction: its powers stay bounded.
  for (double& entry : matrix) entry = 0.5 / kStride;
  for (double& entry : columns) entry = 1e-3;
  double rounds[kRounds];  // ascending
  for (int round = 0; round < kRounds; ++round) {
    const uint64_t start = clock(user);
    for (int i = 0; i < kProducts; ++i) {
      kernel.multiply(matrix, kStride, kNodes, columns, products);
      kernel.add_products(matrix, kStride, kNodes, products, products);
    }
    const uint64_t stop = clock(user);
    const double seconds = stop > start ? 1e-9 * static_cast<double>(stop - start) : 0.0;
    int place = round;
    for (; place > 0 && rounds[place - 1] > seconds; --place) rounds[place] = rounds[place - 1];
    rounds[place] = seconds;
  }
  constexpr double kOperations = kProducts * 2.0 * 27 * kNodes * kNodes;
  const double each = rounds[kRounds / 2] / kOperations;
  return each > kLeastSeconds ? each : kLeastSeconds;
}

}  // namespace palpate
