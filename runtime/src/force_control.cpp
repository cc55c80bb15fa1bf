#include "runtime/src/force_control.hpp"

#include <math.h>

#include <algorithm>

#include "runtime/src/given_factor.hpp"
#include "runtime/src/pack_view.hpp"
#include "runtime/src/zone_exterior.hpp"

namespace palpate {
namespace {

constexpr uint32_t kMostAxes = 3 * pack::kMostZoneContacts;
constexpr double kControlled = 1e-5;
constexpr double kLeastPart = 1e-6;     // of a pivot: below it the rounding of a tangent
constexpr double kLargestForce = 1e60;  // model units: no sum of them overflows

// forces := (A O A y)_a, y along the given axes: the forces of their groups, which move the patches of others.
void add_of_others(const pal_pack& pack, const ZoneSet& set, const uint32_t* axes, uint32_t size,
                   const double* y, double* forces) {
  double brought[kMostAxes] = {};
  double moves[kMostAxes] = {};
  for (uint32_t i = 0; i < size; ++i) {
    for (uint32_t at = 0; at < 3 * set.num_contacts; ++at) brought[at] += set.stiffness[at][axes[i]] * y[i];
  }
  for (uint32_t at = 0; at < set.num_contacts * set.num_contacts; ++at) {
    const uint32_t contact = at / set.num_contacts;
    const uint32_t other = at % set.num_contacts;
    if (group_of(set, contact) == group_of(set, other)) continue;
    const uint32_t begin = pack.patch_starts[set.sites[contact]];
    const uint32_t end = pack.patch_starts[set.sites[contact] + 1];
    for (uint32_t p = begin; p < end; ++p) {
      double rows[9];
      find_moves_of_loads(pack, set.sites[other], pack.patch_nodes + p, 1, 3, rows);
      for (uint32_t k = 0; k < 9; ++k)
        moves[3 * contact + k % 3] +=
            rows[k] * brought[3 * other + k / 3] / (pack.zone_force_scale[set.sites[other]] * (end - begin));
    }
  }
  for (uint32_t i = 0; i < size; ++i) {
    forces[i] = 0;
    for (uint32_t at = 0; at < 3 * set.num_contacts; ++at)
      forces[i] += set.stiffness[axes[i]][at] * moves[at];
  }
}

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
  if (set.num_groups > 1) {
    double of_others[kMostAxes];
    add_of_others(pack, set, axes, size, step, of_others);
    solve_given(K, size, of_others);
    for (uint32_t i = 0; i < size; ++i) step[i] += of_others[i];
  }
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
