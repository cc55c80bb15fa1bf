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

// Gravity now, less the scene's gravity. Model units, organ frame.
struct GravityTurn {
  double now[3];
  double before[3];  // `now` in the last haptic frame
  bool is_turned;    // `now` is not zero
  bool has_changed;  // since the last haptic frame
};

struct TissueState {
  const pal_pack* pack;
  const pal_session_config* config;  // config of the session
  FieldKernel kernel;
  uint32_t num_fixed;
  uint32_t* fixed;         // [max_fixed] contact nodes
  uint32_t fixed_version;  // counts the changes of `fixed`
  double* displacements;  // [max_contacts][3] model units; where patches turn, [max_contacts][3] turns follow
  double* forces;         // [max_contacts][3] model units
  uint32_t* input_flags;  // [max_contacts] flags of the input, set before a model answers
  uint32_t* given_axes;   // [max_contacts] pal_contact::force_axes
  double* given_forces;   // [max_contacts][3] model units
  GravityTurn gravity;
  ResponseKind answered;  // the last answer
  double stored_energy;   // energy of the last answer: J, or the model's units of energy
  double
      energy_brought;  // part of stored_energy that gravity or an inclusion has brought since the last frame
  LinearState linear;
  bool linear_begun;        // linear.next is being prepared
  bool has_joint_transfer;  // linear.active has transferred the last answer of a zone
  ZoneState zone;
  Refinement refinement;  // of a session with zones
  // The last frame read a delivery of the refining lane: a set of contacts, or a correction that it took
  bool is_delivered;
  bool has_new_zone;
  bool has_correction;
  uint64_t operations;  // multiply-adds that a haptic frame may spend on preparation
  FieldSnapshots snapshots;
};

}  // namespace palpate
