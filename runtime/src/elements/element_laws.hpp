// The laws of a pack's materials (pack::ZoneMaterial), by those of runtime/kernels.
#pragma once

#include "runtime/kernels/dyadic_tangent.hpp"
#include "runtime/kernels/element_batch.hpp"
#include "runtime/kernels/isotropic_law.hpp"
#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

// Whether the law is one of dyadic_tangent.hpp; the others are of principal_tangent().
bool is_dyadic(const pack::ZoneMaterial& material);

DyadicTangent dyadic_tangent(const pack::ZoneMaterial& material, double I1, double J);
double dyadic_energy(const pack::ZoneMaterial& material, double I1, double J);

// The tangent and the energy of a lane.
PrincipalTangent principal_tangent(const pack::ZoneMaterial& material, const KinematicsLanes& kinematics,
                                   int lane);

// U of offline/material/volume_split.hpp, U' and U''.
struct VolumeTerm {
  double energy;
  double pressure;
  double stiffness;
};

// Whether U is of the strain's trace instead of J.
bool is_of_strain(const pack::ZoneMaterial& material);

// The argument of U.
double volume_measure(const pack::ZoneMaterial& material, double I1, double J);

VolumeTerm volume_term(const pack::ZoneMaterial& material, double measure);

// Puts a pressure in place of the element's own U'.
void replace_pressure(const pack::ZoneMaterial& material, double I1, double J, double pressure,
                      DyadicTangent& terms);

}  // namespace palpate
