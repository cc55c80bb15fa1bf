// The displacement field of one haptic frame, which the visual frame evaluates.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/pack/compliance.hpp"
#include "runtime/src/polynomial/polynomial_dd.hpp"
#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

inline constexpr uint32_t kNoField = UINT32_MAX;

// The field of one haptic frame, as weights of columns in the pack. API units.
struct FieldState {
  pal_model model;  // the model of the frame; PAL_MODEL_AUTO: the tissue is at rest
  // polynomial_dd, and transfers of nonlinear_zone to contacts between sites:
  uint32_t num_corners;           // sites whose fields are added
  PolynomialFieldState* corners;  // [num_corners]
  // linear_dd, and nodes whose forces also move the nodes of nonlinear_zone:
  uint32_t num_held;   // contact nodes of linear_dd with a force
  uint32_t num_moved;  // nodes of the second kind, behind the first
  uint32_t* held;      // [num_held + num_moved]
  pal_real* weights;   // [num_held + num_moved][3] forces
  // nonlinear_zone:
  uint32_t num_own;     // packed nodes in the zones
  uint32_t* own_nodes;  // [num_own]
  pal_real* own;        // [num_own][3] displacements from the mesh, m
  // Index in ZoneMailbox::fields of the last delivery's displacements; kNoField: displacements at rest
  uint32_t refined_field;
  uint32_t response;                 // index in ZoneMailbox::fields of the derivatives; kNoField: none
  uint32_t num_followed;             // contact axes
  pal_real followed[kMostZoneAxes];  // change of the axes since the last delivery or rest, m and rad
  bool gravity_turned;
  pal_real gravity_turn[3];  // t of gravity.hpp times the metres of a length unit

  NodalForces forces() const { return {num_held, held, weights}; }
  NodalForces moving_forces() const { return {num_moved, held + num_held, weights + size_t{3} * num_held}; }
};

}  // namespace palpate
