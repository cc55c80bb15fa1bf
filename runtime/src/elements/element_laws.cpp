#include "runtime/src/elements/element_laws.hpp"

namespace palpate {

bool is_dyadic(const pack::ZoneMaterial& material) {
  return material.law == pack::ZoneLaw::compressible_neo_hookean || material.law == pack::ZoneLaw::yeoh;
}

DyadicTangent dyadic_tangent(const pack::ZoneMaterial& material, double I1, double J) {
  const double* c = material.constants;
  if (material.law == pack::ZoneLaw::compressible_neo_hookean)
    return compressible_neo_hookean_tangent(c[0], c[1], J);
  return yeoh_tangent({c[0], c[1], c[2], {c[3], c[4], c[5]}}, I1, J);
}

double dyadic_energy(const pack::ZoneMaterial& material, double I1, double J) {
  const double* c = material.constants;
  if (material.law == pack::ZoneLaw::compressible_neo_hookean)
    return compressible_neo_hookean_energy(c[0], c[1], I1, J);
  return yeoh_energy({c[0], c[1], c[2], {c[3], c[4], c[5]}}, I1, J);
}

PrincipalTangent principal_tangent(const pack::ZoneMaterial& material, const KinematicsLanes& kinematics,
                                   int lane) {
  const double* c = material.constants;
  double F[3][3];
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) F[i][j] = kinematics.F[i][j][lane];
  }
  if (material.law == pack::ZoneLaw::st_venant_kirchhoff) return st_venant_kirchhoff_tangent(c[0], c[1], F);
  if (material.law == pack::ZoneLaw::linear_elastic) return linear_elastic_tangent(c[0], c[1], F);
  return ogden_tangent({{c[0], c[1], c[2]}, {c[3], c[4], c[5]}, {c[6], c[7], c[8]}}, F);
}

bool has_strain_measure(const pack::ZoneMaterial& material) {
  return material.law == pack::ZoneLaw::st_venant_kirchhoff;
}

double volume_measure(const pack::ZoneMaterial& material, double I1, double J) {
  return has_strain_measure(material) ? 0.5 * (I1 - 1.0) : J;
}

VolumeTerm volume_term(const pack::ZoneMaterial& material, double measure) {
  const double half_lambda[3] = {0.5 * material.constants[1], 0, 0};
  const double* d = material.law == pack::ZoneLaw::yeoh    ? material.constants + 3
                    : material.law == pack::ZoneLaw::ogden ? material.constants + 6
                                                           : half_lambda;
  const double change = measure - 1.0;
  const double v = change * change;
  return {v * (d[0] + v * (d[1] + v * d[2])), change * (2 * d[0] + v * (4 * d[1] + v * 6 * d[2])),
          2 * d[0] + v * (12 * d[1] + v * 30 * d[2])};
}

void replace_pressure(const pack::ZoneMaterial& material, double I1, double J, double pressure,
                      DyadicTangent& terms) {
  const VolumeTerm own = volume_term(material, volume_measure(material, I1, J));
  const double change = pressure - own.pressure;
  if (has_strain_measure(material)) {
    terms.identity += change;
    terms.ff -= own.stiffness;
  } else {
    terms.transposed -= change * J;
    terms.hh += J * (change - own.stiffness * J);
  }
}

}  // namespace palpate
