// Evaluates the law of a pack's material (pack::ZoneMaterial) with runtime/kernels.
#pragma once

#include "runtime/kernels/dyadic_tangent.hpp"
#include "runtime/kernels/element_batch.hpp"
#include "runtime/kernels/isotropic_law.hpp"
#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

// Whether the law is in dyadic_tangent.hpp. The other laws are in isotropic_law.hpp.
bool is_dyadic(const pack::ZoneMaterial& material);

DyadicTangent dyadic_tangent(const pack::ZoneMaterial& material, double I1, double J);
double dyadic_energy(const pack::ZoneMaterial& material, double I1, double J);

// Evaluates a law of isotropic_law.hpp in one lane: energy, stress and tangent.
PrincipalTangent principal_tangent(const pack::ZoneMaterial& material, const KinematicsLanes& kinematics,
                                   int lane);

// The volumetric energy U(theta) of a law (offline/material/volume_split.hpp), per reference volume.
struct VolumeTerm {
  double energy;     // U
  double pressure;   // U'
  double stiffness;  // U''
};

// Whether theta = 1 + tr E with the Green strain E; else theta = J.
bool has_strain_measure(const pack::ZoneMaterial& material);

// Returns theta.
double volume_measure(const pack::ZoneMaterial& material, double I1, double J);

VolumeTerm volume_term(const pack::ZoneMaterial& material, double measure);

// Replaces the element's own U' by `pressure` in `terms`, and its own U'' by zero.
void replace_pressure(const pack::ZoneMaterial& material, double I1, double J, double pressure,
                      DyadicTangent& terms);

}  // namespace palpate
