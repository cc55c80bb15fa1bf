/* Recordings: every call that changes a session, to be replayed to the same bits. */
#ifndef PALPATE_RECORDING_H
#define PALPATE_RECORDING_H

#include <palpate/session.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Writes every later call that changes the session, its input and a digest of its answer, to `buffer`. The session must
 * be new. A haptic frame takes 32 bytes, 56 more for each pose, 8 for each age and 24 for each tool. `buffer`: aligned to
 * 8, the caller's again after pal_session_stop_recording. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_session_record(pal_session* session, void* buffer,
                                                    size_t buffer_bytes) PAL_NOEXCEPT;

/* `bytes`: size of the recording. `complete`: 0 where the buffer was full before the end; the part in it can be replayed;
 * may be NULL. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_session_stop_recording(pal_session* session, size_t* bytes,
                                                            uint32_t* complete) PAL_NOEXCEPT;

/* The config of the recorded session, with which a session for its replay must start. Set config->struct_size first.
 * Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_recording_get_config(const void* recording, size_t bytes,
                                                          pal_session_config* config) PAL_NOEXCEPT;

/* The state of a replay. At its start all is zero but struct_size. */
typedef struct pal_replay {
  uint32_t struct_size;
  uint32_t ended;    /* 1: there is no further call */
  uint64_t offset;   /* of the next call: bytes */
  uint64_t frames;   /* haptic and contact frames so far */
  double seconds;    /* sum of dt of the haptic frames so far: s */
  uint32_t diverged; /* 1: the answer of the last call differs from the recorded bits */
  uint32_t index;    /* the first tool or contact whose force differs; 0 if none */
  double recorded_force[3];
  double force[3];
} pal_replay;

/* Makes the next recorded call, on a session that has made exactly the calls before it. On the same build, pack and kind
 * of processor the answer has the same bits. Real-time safe: as the recorded call. */
PAL_NODISCARD PAL_API pal_status pal_session_replay(pal_session* session, const void* recording, size_t bytes,
                                                    pal_replay* replay) PAL_NOEXCEPT;

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_RECORDING_H */
