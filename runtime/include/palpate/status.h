/* pal_status tells whether a call succeeded. PAL_FLAG_... mark doubtful answers. */
#ifndef PALPATE_STATUS_H
#define PALPATE_STATUS_H

#include <palpate/version.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A failed call changes nothing and writes no output. Values are pinned, and each group of ten may grow. */
typedef enum pal_status {
  PAL_STATUS_OK = 0,
  /* the call */
  PAL_STATUS_NULL_ARGUMENT = 10,
  PAL_STATUS_BAD_STRUCT_SIZE = 11, /* struct_size is not set, or a member unknown to the library is not 0 */
  PAL_STATUS_BAD_ARGUMENT = 12,    /* an argument is outside its documented range */
  /* An input is NaN, infinite or a position beyond 1e100. In a config: PAL_STATUS_BAD_ARGUMENT. */
  PAL_STATUS_NOT_FINITE = 13,
  PAL_STATUS_NO_SUCH_SITE = 14,
  PAL_STATUS_NO_SUCH_NODE = 15,
  /* The pack or session lacks a model, tree, gravity or turning patches that the call needs. */
  PAL_STATUS_NO_SUCH_MODEL = 16,
  PAL_STATUS_MODEL_CANNOT_ANSWER = 17, /* no model of the session can answer this call */
  PAL_STATUS_NO_SUCH_TOOL = 18,        /* the index is at or beyond the session's max_tools */
  PAL_STATUS_ALREADY_USED = 19,        /* a recording must start before any other call on the session */
  /* memory */
  PAL_STATUS_ARENA_TOO_SMALL = 20,
  PAL_STATUS_ARENA_MISALIGNED = 21,
  PAL_STATUS_CAPACITY_EXCEEDED = 22, /* the config of the session, or the buffer, allows less */
  /* the file */
  PAL_STATUS_FILE_NOT_FOUND = 30,
  PAL_STATUS_FILE_NOT_READABLE = 31,
  /* the pack */
  PAL_STATUS_NOT_A_PACK = 40,
  PAL_STATUS_WRONG_VERSION = 41, /* the pack has another format version: build it again */
  PAL_STATUS_TRUNCATED = 42,
  PAL_STATUS_CORRUPT_TABLES = 43,  /* the FlatBuffer does not verify */
  PAL_STATUS_CORRUPT_CONTENT = 44, /* tables contradict each other or hold impossible values */
  PAL_STATUS_BAD_CHECKSUM = 45,
  PAL_STATUS_OTHER_PRECISION = 46, /* pack and library differ in PALPATE_FLOAT64 */
  /* the recording */
  PAL_STATUS_NOT_A_RECORDING = 50,
  PAL_STATUS_CORRUPT_RECORDING = 51,
  PAL_STATUS_RECORDING_OF_OTHER_PACK = 52,
  PAL_STATUS_NOT_RECORDING = 53,
  PAL_STATUS_RECORDING_OF_OTHER_BUILD = 54
} pal_status;

/* Returns one English sentence without a full stop; never NULL. Real-time safe: yes. */
PAL_API const char* pal_status_text(pal_status status) PAL_NOEXCEPT;

/* Flags of an answer: bits of pal_contact_result::flags and pal_tool_result::flags. docs/embedding.md states
 * the reaction to each flag. */
enum {
  /* The displacement or the load is beyond the range that the pack's builder sampled. */
  PAL_FLAG_EXTRAPOLATED = 1 << 0,
  /* The displacement was far beyond the sampled range, or the turn of a patch above a quarter turn. The
   * answer belongs to a shortened displacement or turn. */
  PAL_FLAG_CLAMPED = 1 << 1,
  /* No nonlinear model of the pack can answer these contacts and fixed nodes; linear_dd answered. */
  PAL_FLAG_LINEAR_FALLBACK = 1 << 2,
  /* Two contacts hold the same node. The node follows their mean. */
  PAL_FLAG_OVERLAPPING = 1 << 3,
  /* The compliance of nearby contact nodes is singular to rounding, or the given forces cannot all act. */
  PAL_FLAG_ILL_CONDITIONED = 1 << 4,
  /* Tools: a pose, an age or dt was invalid. The last valid value was used. */
  PAL_FLAG_BAD_INPUT = 1 << 5,
  /* Tools: the input is older than stale_seconds. The force ramps to zero, or back from zero. */
  PAL_FLAG_STALE = 1 << 6,
  /* Tools: force and torque were limited by max_force, max_torque or their rates. */
  PAL_FLAG_LIMITED = 1 << 7,
  /* Tools: contacts, fixed nodes or the model have changed. The jump of the force fades out. */
  PAL_FLAG_BLENDING = 1 << 8,
  /* Tools: the tool touched, but no further contact can be held or answered. */
  PAL_FLAG_NO_ROOM = 1 << 9,
  /* The model for new contacts or fixed nodes is in preparation, by pal_session_refine or within
   * budget_operations. Earlier contacts follow their tools; linear_dd answers the other contacts. */
  PAL_FLAG_PREPARING = 1 << 10,
  /* Tools: the model's force was not finite, as in a damaged pack. Comes with PAL_FLAG_HELD. */
  PAL_FLAG_NOT_FINITE = 1 << 11,
  /* Tools: force and stiffness were reduced, so that tools gain no more energy than they put in. */
  PAL_FLAG_REDUCED = 1 << 12,
  /* A contact between sites was answered at the site of its largest weight, or as if it were alone. */
  PAL_FLAG_NEAREST_SITE = 1 << 13,
  /* nonlinear_zone has not converged at this displacement, or has converged to an unstable equilibrium.
   * pal_contact_result::displacement is the contact's current displacement. If contacts jam tissue between
   * them, force and stiffness may have any value. */
  PAL_FLAG_UNCONVERGED = 1 << 14,
  /* Tools: the model's force may have any value, for example from a jam of tissue until the next convergence.
   * The last good force plays and fades to zero over ramp_seconds; the stiffness is 0. */
  PAL_FLAG_HELD = 1 << 15,
  /* No iteration of pal_session_refine for these contacts and this inclusion has ended, or the last iteration
   * failed. The error estimates come from the pack's survey, or are 1 after an earlier iteration. */
  PAL_FLAG_UNREFINED = 1 << 16
};

/* With any of these flags a force is unreliable. In a contact frame the force may have any value: do not play
 * it. A tool's force is safe to play: limited, and held when the model's force may have any value. */
#define PAL_FLAGS_UNRELIABLE \
  (PAL_FLAG_ILL_CONDITIONED | PAL_FLAG_NOT_FINITE | PAL_FLAG_UNCONVERGED | PAL_FLAG_HELD)

/* Returns one English sentence without a full stop for one flag bit; never NULL. Real-time safe: yes. */
PAL_API const char* pal_flag_text(uint32_t flag) PAL_NOEXCEPT;

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_STATUS_H */
