// The displacement field of one haptic frame, as weights of columns in the pack.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/pack/compliance.hpp"
#include "runtime/src/polynomial/polynomial_dd.hpp"
#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

inline constexpr uint32_t kNoField = UINT32_MAX;

// The field of one haptic frame, as weights of columns in the pack. API units.
struct FieldState {
  pal_model model;  // that answered; PAL_MODEL_AUTO: the tissue is at rest
  uint32_t
      num_corners;  // polynomial_dd, and where nonlinear_zone is moved by it: sites whose fields are added
  PolynomialFieldState* corners;  // [num_corners]
  uint32_t num_held;              // linear_dd: contact nodes with a force,
  uint32_t num_moved;             // and behind them nodes whose forces move nonlinear_zone itself too
  uint32_t* held;                 // [num_held + num_moved]
  pal_real* weights;              // and their forces [num_held + num_moved][3]
  uint32_t num_own;               // nonlinear_zone: packed nodes in it, which move otherwise
  uint32_t* own_nodes;
  pal_real* own;  // [num_own][3] displacements from the mesh
  // nonlinear_zone, refined: the field of ZoneMailbox with the displacements of all packed nodes at the last delivery,
  // in place of those at rest. kNoField: none
  uint32_t refined_field;
  // nonlinear_zone: the field of ZoneMailbox with the derivatives, and by how much its axes have moved since. kNoField: none
  uint32_t response;
  uint32_t num_followed;
  pal_real followed[kMostZoneAxes];  // m, rad
  bool gravity_turned;
  pal_real gravity_turn[3];

  NodalForces forces() const { return {num_held, held, weights}; }
  NodalForces moving_forces() const { return {num_moved, held + num_held, weights + size_t{3} * num_held}; }
};

}  // namespace palpate
