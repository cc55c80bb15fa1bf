// The tissue of one session: its contacts, the response models and the displacement field. Tools and
// recordings have their own state.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/linear/linear_blend.hpp"
#include "runtime/src/numerics/field_kernel.hpp"
#include "runtime/src/refining/refinement.hpp"
#include "runtime/src/response/field_snapshot.hpp"
#include "runtime/src/response/response_kind.hpp"
#include "runtime/src/zone/nonlinear_zone.hpp"

namespace palpate {

// t = g - g0 (gravity.hpp): gravity less the scene's gravity. Model units, organ frame.
struct GravityTurn {
  double now[3];
  double before[3];  // `now` in the last haptic frame
  bool is_turned;    // `now` is not zero
  bool has_changed;  // `now` has changed since the last haptic frame
};

struct TissueState {
  const pal_pack* pack;
  const pal_session_config* config;  // config of the session
  FieldKernel kernel;
  uint32_t num_fixed;
  uint32_t* fixed;         // [max_fixed] contact nodes
  uint32_t fixed_version;  // counts the changes of `fixed`
  double* displacements;   // [count][3] of the contacts, model units; then [count][3] turns if patches rotate
  double* forces;          // [max_contacts][3] model units
  uint32_t* input_flags;   // [max_contacts] flags of the input, set before a model answers
  uint32_t* given_axes;    // [max_contacts] pal_contact::force_axes
  double* given_forces;    // [max_contacts][3] model units
  GravityTurn gravity;
  ResponseKind answered;  // response of the last frame
  double stored_energy;   // energy of the last answer: J, or the model's units of energy
  double energy_brought;  // change of stored_energy by gravity and inclusions since the last frame
  LinearState linear;
  bool linear_begun;        // linear.next is in preparation
  bool has_joint_transfer;  // the last answer of a zone includes linear.active (response_at_point.hpp)
  ZoneState zone;
  Refinement refinement;  // the refining lane, which prepares and corrects zones between frames
  bool is_delivered;      // this frame read a delivery of the refining lane
  bool has_new_zone;      // the delivery was a zone for new contacts
  bool has_correction;    // the delivery was a correction of the exterior, and the frame took the correction
  uint64_t operations;    // multiply-adds that a haptic frame may spend on preparation
  FieldSnapshots snapshots;
};

}  // namespace palpate
