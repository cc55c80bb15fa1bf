// Evaluates energy, stress and tangent of the law that a material holds.
#pragma once

#include "offline/material/compressible_neo_hookean.hpp"
#include "offline/material/elastic.hpp"
#include "offline/material/invariant_law.hpp"
#include "offline/material/ogden.hpp"

namespace palpate {

// Returns W per reference volume. Requires det F > 0, except for LinearElastic and StVenantKirchhoff.
inline double strain_energy_density(const Law& law, const Eigen::Matrix3d& F) {
  return std::visit([&](const auto& concrete) { return strain_energy_density(concrete, F); }, law);
}

inline Eigen::Matrix3d first_piola_kirchhoff(const Law& law, const Eigen::Matrix3d& F) {
  return std::visit([&](const auto& concrete) { return first_piola_kirchhoff(concrete, F); }, law);
}

inline StressAndTangent stress_and_tangent(const Law& law, const Eigen::Matrix3d& F) {
  return std::visit([&](const auto& concrete) { return stress_and_tangent(concrete, F); }, law);
}

// Whether the law's energy depends on I1 and J alone.
inline bool has_dyadic_tangent(const Law& law) {
  const auto* invariant = std::get_if<InvariantLaw>(&law);
  return std::holds_alternative<CompressibleNeoHookean>(law) ||
         (invariant != nullptr && invariant->c01 == 0.0);
}

// Requires has_dyadic_tangent(). Always inlined, because the element loop calls this function in every pass.
[[gnu::always_inline]] inline DyadicTangent dyadic_tangent(const Law& law, double I1, double J) {
  const auto* neo_hookean = std::get_if<CompressibleNeoHookean>(&law);
  return neo_hookean != nullptr ? dyadic_tangent(*neo_hookean, I1, J)
                                : dyadic_tangent(std::get<InvariantLaw>(law), I1, J);
}

}  // namespace palpate
