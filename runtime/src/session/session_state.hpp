// The whole state of one simulation, in the caller's arena.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/response/tissue_state.hpp"
#include "runtime/src/session/recording.hpp"
#include "runtime/src/tools/tools.hpp"

namespace palpate {

inline constexpr uint32_t kMostFixed = 1024;
inline constexpr uint32_t kAllAxes = 7;             // all bits of pal_contact::force_axes
inline constexpr uint32_t kFirstConfigBytes = 144;  // size of pal_session_config in the first release

}  // namespace palpate

struct pal_session {
  pal_session_config config;
  palpate::TissueState tissue;
  double* turns;  // [max_contacts][3] rotations of contacts in contact frames (patch_rotation.hpp)
  palpate::ToolStates tools;
  uint32_t num_requested;        // 0: the visual frame writes all nodes
  uint32_t* requested;           // [max_requested] packed nodes, ascending
  uint32_t* requested_by_panel;  // [max_requested] places in `requested`, sorted by compressed panel
  palpate::Recorder recorder;
  pal_counters counters;
  bool used;         // a call has changed the session
  bool by_contacts;  // the last frame was a contact frame
};
