// What a session is inside the runtime: everything that one simulation remembers, in the caller's arena.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/field_kernel.hpp"
#include "runtime/src/field_snapshot.hpp"
#include "runtime/src/linear_blend.hpp"
#include "runtime/src/nonlinear_zone.hpp"
#include "runtime/src/recording.hpp"
#include "runtime/src/tools.hpp"

namespace palpate {

inline constexpr uint32_t kMostFixed = 1024;
inline constexpr uint32_t kAllAxes = 7;             // of pal_contact::force_axes
inline constexpr uint32_t kFirstConfigBytes = 168;  // of pal_session_config in the first release

}  // namespace palpate

struct pal_session {
  const pal_pack* pack;
  pal_session_config config;
  palpate::FieldKernel kernel;
  uint32_t num_fixed;
  uint32_t* fixed;         // [max_fixed] contact nodes
  uint32_t fixed_version;  // how often they have changed
  uint32_t num_requested;  // 0: all nodes
  uint32_t* requested;     // [max_requested] packed nodes, ascending
  uint32_t*
      requested_by_panel;  // [max_requested] places in `requested`, as compressed panels hold their nodes
  double* displacements;   // [max_contacts][3] model units; then as many turns, where patches turn in a zone
  double* turns;           // [max_contacts][3] of contact frames (patch_turns.hpp)
  double* forces;          // [max_contacts][3] model units
  double gravity_turn[3];  // what gravity has become, less the scene's: model units, organ frame
  bool gravity_turned;     // it is not zero
  bool gravity_changed;    // since the last haptic frame
  double turn_before[3];   // gravity_turn in that frame
  double
      energy_brought;  // of stored_energy, what turned gravity or an inclusion has brought since: as stored_energy
  double stored_energy;   // of the last answer: J, or the model's units of energy
  uint32_t* input_flags;  // [max_contacts] what was done to the displacement before any model saw it
  uint32_t* given_axes;   // [max_contacts] pal_contact::force_axes
  double* given_forces;   // [max_contacts][3] model units
  palpate::LinearState linear;
  bool linear_begun;    // linear.next is being made ready
  bool moved_together;  // linear.answering has moved the zone that answered last
  palpate::ZoneState zone;
  bool zone_begun;      // zone.next is being made ready
  uint64_t operations;  // multiply-adds that a haptic frame may spend on that
  palpate::FieldSnapshots snapshots;
  palpate::ToolStates tools;
  palpate::Recorder recorder;
  pal_counters counters;
  bool used;         // something has happened to it
  bool by_contacts;  // the last frame was a contact frame
};
