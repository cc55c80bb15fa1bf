#include "runtime/src/response/force_control.hpp"

#include <math.h>

#include <algorithm>

#include "runtime/src/numerics/semidefinite_cholesky.hpp"
#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

constexpr uint32_t kMostAxes = 3 * pack::kMostZoneContacts;
constexpr double kControlled = 1e-5;    // a smaller step, relative to the largest displacement, is negligible
constexpr double kLeastPart = 1e-6;     // a smaller pivot, relative to its diagonal entry, is rounding
constexpr double kLargestForce = 1e60;  // model units: sums of such forces do not overflow

double largest_of(const double* numbers, uint32_t count) {
  double largest = 0;
  for (uint32_t i = 0; i < count; ++i) largest = std::max(largest, fabs(numbers[i]));
  return largest;
}

}  // namespace

ForceControl control_forces(const pal_pack& pack, const ZoneSet& set, const pal_contact* contacts,
                            const PointResponse* transfer, const double* couplings, double* displacements) {
  uint32_t axes[kMostAxes];  // 3 x contact + axis
  uint32_t size = 0;
  double largest_displacement = 1e-6 * pack.max_displacement;
  for (uint32_t at = 0; at < 3 * set.num_contacts; ++at) {
    largest_displacement = std::max(largest_displacement, fabs(set.followed[at]));
    if (is_force_given(contacts[at / 3], at % 3)) axes[size++] = at;
  }
  double K[kMostAxes * kMostAxes];  // K_aa, upper triangle
  double step[kMostAxes];
  for (uint32_t i = 0; i < size; ++i) {
    const uint32_t contact = axes[i] / 3;
    const uint32_t axis = axes[i] % 3;
    const double given = contacts[contact].force[axis] / pack.newtons;
    step[i] = std::min(kLargestForce, std::max(-kLargestForce, given)) - set.force[axes[i]] -
              transfer[contact].force[axis];
    for (uint32_t j = i; j < size; ++j) {
      double& entry = K[i * size + j];
      entry = set.stiffness[axes[i]][axes[j]];
      if (axes[j] / 3 == contact) {
        entry += transfer[contact].stiffness[3 * axis + axes[j] % 3];
      } else if (couplings != nullptr) {
        entry += couplings[axes[i] * 3 * set.num_contacts + axes[j]];
      }
    }
  }
  if (size == 0) return {true, 0};
  uint32_t flags = factor_semidefinite(size, kLeastPart, K) ? 0 : PAL_FLAG_ILL_CONDITIONED;
  solve_semidefinite(K, size, step);
  const double longest = largest_of(step, size);
  if (longest <= kControlled * largest_displacement) return {true, flags};
  const double part = longest > pack.max_displacement ? pack.max_displacement / longest : 1.0;
  const double limit = kMostGiven * pack.max_displacement;
  for (uint32_t i = 0; i < size; ++i) {
    const double wanted = set.followed[axes[i]] + part * step[i];
    displacements[axes[i]] = std::min(limit, std::max(-limit, wanted));
    if (!(fabs(wanted) <= limit)) flags |= PAL_FLAG_CLAMPED | PAL_FLAG_EXTRAPOLATED;
  }
  return {false, flags};
}

}  // namespace palpate
