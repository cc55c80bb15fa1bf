#include "runtime/src/force_control.hpp"

#include <math.h>

#include "runtime/src/pack_view.hpp"

namespace palpate {
namespace {

constexpr uint32_t kMostAxes = 3 * pack::kMostZoneContacts;
constexpr double kControlled = 1e-5;
constexpr double kLargestForce = 1e60;  // model units: no sum of them overflows

// Solves K x = b in place by Cholesky's factor of the lower triangle. False where K is not positive definite.
bool solve_small(uint32_t size, double K[kMostAxes][kMostAxes], double* b) {
  for (uint32_t j = 0; j < size; ++j) {
    for (uint32_t k = 0; k < j; ++k) {
      for (uint32_t i = j; i < size; ++i) K[i][j] -= K[i][k] * K[j][k];
    }
    if (!(K[j][j] > 0)) return false;
    const double pivot = sqrt(K[j][j]);
    for (uint32_t i = j; i < size; ++i) K[i][j] /= pivot;
  }
  for (uint32_t i = 0; i < size; ++i) {
    for (uint32_t k = 0; k < i; ++k) b[i] -= K[i][k] * b[k];
    b[i] /= K[i][i];
  }
  for (uint32_t i = size; i-- > 0;) {
    for (uint32_t k = i + 1; k < size; ++k) b[i] -= K[k][i] * b[k];
    b[i] /= K[i][i];
  }
  return true;
}

}  // namespace

ForceControl control_forces(const pal_pack& pack, const ZoneSet& set, const pal_contact* contacts,
                            const PlaceAnswer* moved, double* displacements) {
  uint32_t axes[kMostAxes];  // 3 x contact + axis
  uint32_t size = 0;
  double push = 1e-6 * pack.max_displacement;
  for (uint32_t at = 0; at < 3 * set.num_contacts; ++at) {
    push = fmax(push, fabs(set.followed[at]));
    if (is_force_given(contacts[at / 3], at % 3)) axes[size++] = at;
  }
  double K[kMostAxes][kMostAxes];
  double step[kMostAxes];
  for (uint32_t i = 0; i < size; ++i) {
    const uint32_t contact = axes[i] / 3;
    const uint32_t axis = axes[i] % 3;
    const double given = contacts[contact].force[axis] / pack.newtons;
    step[i] =
        fmin(fmax(given, -kLargestForce), kLargestForce) - set.force[axes[i]] - moved[contact].force[axis];
    for (uint32_t j = 0; j <= i; ++j) {
      K[i][j] = set.stiffness[axes[i]][axes[j]];
      if (axes[j] / 3 == contact) K[i][j] += moved[contact].stiffness[3 * axis + axes[j] % 3];
    }
  }
  if (size == 0) return {true, 0};
  if (!solve_small(size, K, step)) return {false, 0};
  double longest = 0;
  for (uint32_t i = 0; i < size; ++i) longest = fmax(longest, fabs(step[i]));
  if (longest <= kControlled * push) return {true, 0};
  const double part = longest > pack.max_displacement ? pack.max_displacement / longest : 1.0;
  const double most = kMostGiven * pack.max_displacement;
  uint32_t flags = 0;
  for (uint32_t i = 0; i < size; ++i) {
    const double wanted = set.followed[axes[i]] + part * step[i];
    displacements[axes[i]] = fmin(fmax(wanted, -most), most);
    if (!(fabs(wanted) <= most)) flags = PAL_FLAG_CLAMPED | PAL_FLAG_EXTRAPOLATED;
  }
  return {false, flags};
}

}  // namespace palpate
