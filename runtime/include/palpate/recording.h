/* Recordings of every call that changes a session. A replay gives the same bits. */
#ifndef PALPATE_RECORDING_H
#define PALPATE_RECORDING_H

#include <palpate/session.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Starts to write every call that changes a new session to `buffer`, with input and a digest of the answer. A
 * haptic frame takes 32 bytes, 56 more for each pose, 8 for each age and 24 for each tool. `buffer`: aligned
 * to 8, in use until pal_session_stop_recording. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_session_record(pal_session* session, void* buffer,
                                                    size_t buffer_bytes) PAL_NOEXCEPT;

/* Ends the recording. `bytes`: its size. `complete`: 0 if the buffer was full before the end; the recorded
 * part can be replayed. `complete` may be NULL. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_session_stop_recording(pal_session* session, size_t* bytes,
                                                            uint32_t* complete) PAL_NOEXCEPT;

/* Returns the config of the recorded session. A session for the replay must start with this config. Set
 * config->struct_size first. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_recording_get_config(const void* recording, size_t bytes,
                                                          pal_session_config* config) PAL_NOEXCEPT;

/* The state of a replay. At the start, all members but struct_size are zero. */
typedef struct pal_replay {
  uint32_t struct_size;
  uint32_t ended;           /* 1: the recording has no further call */
  uint64_t offset;          /* offset of the next call: bytes */
  uint64_t frames;          /* haptic and contact frames so far */
  double seconds;           /* sum of dt of the haptic frames so far: s */
  uint32_t diverged;        /* 1: the answer of the last call differs from the recorded bits */
  uint32_t index;           /* the first tool or contact whose force differs; 0 if none */
  double recorded_force[3]; /* of tool or contact `index`: N */
  double force[3];          /* the same force in the replay: N */
} pal_replay;

/* Repeats the next recorded call on a session that has made exactly the earlier calls. With the same build,
 * pack and kind of processor the answer has the same bits. Real-time safe: as the recorded call. */
PAL_NODISCARD PAL_API pal_status pal_session_replay(pal_session* session, const void* recording, size_t bytes,
                                                    pal_replay* replay) PAL_NOEXCEPT;

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_RECORDING_H */
