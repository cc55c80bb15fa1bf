// A recording holds every call that changed a session, so that replay can repeat the calls.
//
//    RecordingHeader | pal_session_config | call | call | ...
//
// A call is a CallHeader and its input. A frame adds a digest of the answer and the forces. Each part is a
// multiple of 8 bytes. The session reads no clock, so the recorded calls determine every result.
#pragma once

#include <palpate/palpate.h>

namespace palpate {

struct Recorder {
  unsigned char* buffer;  // null: no recording
  size_t capacity;
  size_t used;
  bool full;  // a call did not fit
};

// Each function writes one call that has just succeeded, or nothing when the session has no recording. A
// frame that read a delivery of the refining lane writes Call::delivery first.
void record_fixed(pal_session& session, const uint32_t* contact_nodes, uint32_t count);
void record_hold(pal_session& session, uint32_t tool, const pal_hold& hold);
void record_release(pal_session& session, uint32_t tool);
void record_touch(pal_session& session, uint32_t tool, const pal_touch* touch);
void record_gravity(pal_session& session, const double* acceleration);
void record_inclusion(pal_session& session, const pal_inclusion* inclusion);
void record_orientations(pal_session& session, const double* orientations, uint32_t count);
void record_contact_frame(pal_session& session, const pal_contact* contacts, uint32_t count,
                          const pal_contact_result* results);
// `results`: [max_tools]
void record_haptic_frame(pal_session& session, const pal_haptic_input& input, const pal_tool_result* results);

}  // namespace palpate
