#include "offline/material/law.hpp"

namespace palpate {
namespace {

template <typename HookesLaw>
SmallStrainModuli lame_moduli(const HookesLaw& law) {
  return {law.mu, law.lambda + 2.0 / 3.0 * law.mu};
}

// Returns U''(J) at J = 1 for U = (J - 1)^2 / D_1 + ...; the second derivatives of other terms are 0.
double bulk_modulus(const VolumetricEnergy& energy) {
  return 2 * energy.inverse_d[0];
}

SmallStrainModuli moduli(const CompressibleNeoHookean& law) {
  return lame_moduli(law);
}
SmallStrainModuli moduli(const InvariantLaw& law) {
  return {2 * (law.c10 + law.c01), bulk_modulus(law.volumetric)};
}
SmallStrainModuli moduli(const Ogden& law) {
  double shear = 0;
  for (const Ogden::Term& term : law.terms) shear += term.mu;
  return {shear, bulk_modulus(law.volumetric)};
}
SmallStrainModuli moduli(const LinearElastic& law) {
  return lame_moduli(law);
}
SmallStrainModuli moduli(const StVenantKirchhoff& law) {
  return lame_moduli(law);
}

}  // namespace

SmallStrainModuli small_strain_moduli(const Law& law) {
  return std::visit([](const auto& concrete) { return moduli(concrete); }, law);
}

}  // namespace palpate
