#include "runtime/src/force_control.hpp"

#include <math.h>

#include <algorithm>

#include "runtime/src/given_factor.hpp"
#include "runtime/src/pack_view.hpp"

namespace palpate {
namespace {

constexpr uint32_t kMostAxes = 3 * pack::kMostZoneContacts;
constexpr double kControlled = 1e-5;
constexpr double kLeastPart = 1e-6;     // of a pivot: below it the rounding of a tangent
constexpr double kLargestForce = 1e60;  // model units: no sum of them overflows

}  // namespace

ForceControl control_forces(const pal_pack& pack, const ZoneSet& set, const pal_contact* contacts,
                            const PlaceAnswer* moved, const double* couplings, double* displacements) {
  uint32_t axes[kMostAxes];  // 3 x contact + axis
  uint32_t size = 0;
  double push = 1e-6 * pack.max_displacement;
  for (uint32_t at = 0; at < 3 * set.num_contacts; ++at) {
    push = std::max(push, fabs(set.followed[at]));
    if (is_force_given(contacts[at / 3], at % 3)) axes[size++] = at;
  }
  double K[kMostAxes * kMostAxes];  // the upper triangle
  double step[kMostAxes];
  for (uint32_t i = 0; i < size; ++i) {
    const uint32_t contact = axes[i] / 3;
    const uint32_t axis = axes[i] % 3;
    const double given = contacts[contact].force[axis] / pack.newtons;
    step[i] = std::min(kLargestForce, std::max(-kLargestForce, given)) - set.force[axes[i]] -
              moved[contact].force[axis];
    for (uint32_t j = i; j < size; ++j) {
      double& entry = K[i * size + j];
      entry = set.stiffness[axes[i]][axes[j]];
      if (axes[j] / 3 == contact) {
        entry += moved[contact].stiffness[3 * axis + axes[j] % 3];
      } else if (couplings != nullptr) {
        entry += couplings[axes[i] * 3 * set.num_contacts + axes[j]];
      }
    }
  }
  if (size == 0) return {true, 0};
  uint32_t flags = factor_given(size, kLeastPart, K) ? 0 : PAL_FLAG_ILL_CONDITIONED;
  solve_given(K, size, step);
  double longest = 0;
  for (uint32_t i = 0; i < size; ++i) longest = std::max(longest, fabs(step[i]));
  if (longest <= kControlled * push) return {true, flags};
  const double part = longest > pack.max_displacement ? pack.max_displacement / longest : 1.0;
  const double most = kMostGiven * pack.max_displacement;
  for (uint32_t i = 0; i < size; ++i) {
    const double wanted = set.followed[axes[i]] + part * step[i];
    displacements[axes[i]] = std::min(most, std::max(-most, wanted));
    if (!(fabs(wanted) <= most)) flags |= PAL_FLAG_CLAMPED | PAL_FLAG_EXTRAPOLATED;
  }
  return {false, flags};
}

}  // namespace palpate
