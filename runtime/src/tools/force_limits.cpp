#include "runtime/src/tools/force_limits.hpp"

#include <math.h>

#include <algorithm>

#include "runtime/src/linear/linear_point.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/polynomial/polynomial_dd.hpp"

namespace palpate {
namespace {

// |K| by linear_dd, or by the Hessian of the polynomial energy at rest. Model units.
double rest_stiffness_norm(const pal_pack& pack, uint32_t site) {
  if (pack.site_forces != nullptr) return patch_stiffness_norm(pack, site);
  constexpr double kRest[3] = {};
  PolynomialAnswer at_rest = {};
  PolynomialFieldState field;
  evaluate_polynomial(pack, site, kRest, at_rest, field);
  double square = 0;
  for (const double entry : at_rest.stiffness) square += entry * entry;
  return sqrt(square);
}

// F, in the model's force unit. Ignores values that are not finite, as an unverified pack may hold.
double largest_linear_force(const pal_pack& pack) {
  double largest = 0;
  for (uint32_t site = 0; site < pack.num_sites; ++site) {
    const double force = pack.max_displacement * rest_stiffness_norm(pack, site);
    if (force > largest && isfinite(force)) largest = force;
  }
  return largest;
}

}  // namespace

void fill_limits(const pal_pack& pack, pal_session_config& config) {
  constexpr double kMargin = 5;
  constexpr double kRiseSeconds = 0.01;  // a hand takes longer to reach max_force
  if (config.max_force == 0 || config.max_force_rate == 0) {
    const double usual = kMargin * largest_linear_force(pack) * pack.newtons;
    if (config.max_force == 0) config.max_force = usual;
    if (config.max_force_rate == 0) config.max_force_rate = std::min(config.max_force, usual) / kRiseSeconds;
  }
  if (config.max_torque == 0) config.max_torque = HUGE_VAL;
  if (config.max_torque_rate == 0) config.max_torque_rate = HUGE_VAL;
}

}  // namespace palpate
