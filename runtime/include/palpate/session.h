/* A session: the state of one simulation, in memory of the caller. */
#ifndef PALPATE_SESSION_H
#define PALPATE_SESSION_H

#include <palpate/pack.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct pal_session pal_session; /* opaque; lives in the caller's arena */

/* A position and an orientation: x becomes R x + position. This struct does not grow. */
typedef struct pal_pose {
  double position[3];    /* m */
  double orientation[4]; /* R as a unit quaternion w, x, y, z */
} pal_pose;

typedef struct pal_session_config {
  uint32_t struct_size;
  uint32_t max_contacts;  /* contacts of all tools together: 1 .. 64. Default: the scene's */
  uint32_t max_fixed;     /* nodes fixed at run time: 0 .. 1024. Default: 0 */
  pal_model model;        /* default: PAL_MODEL_AUTO */
  uint32_t max_tools;     /* 0 .. 16. Default: 4 */
  uint32_t max_requested; /* nodes that pal_session_request_nodes may name: 0 .. num_nodes. Default: 0 */
  pal_pose organ;         /* pose of the organ frame in the world. Default: the frames coincide */
  double blend_seconds;   /* time to fade out a jump of a tool's force: s. 0: no fading. Default: 0.01 */
  double stale_seconds;   /* age of input at which the force ramps to zero: s. 0: never. Default: 0.05 */
  double ramp_seconds;    /* duration of the ramp to zero, and of the ramp back: s. Default: 0.05 */
  /* Limits of each tool: N, N m, N/s, N m/s. One factor scales force and torque to the limits. INFINITY: no
   * limit. 0, the default, means for max_force five times the largest force of any site at max_displacement,
   * by the site's stiffness at rest; for max_force_rate this force, or a smaller max_force, in 10 ms; for
   * torques no limit. The rates do not limit a force that fades to zero (PAL_FLAG_STALE, PAL_FLAG_HELD). */
  double max_force;
  double max_torque;
  double max_force_rate;
  double max_torque_rate;
  /* Multiply-adds that one haptic frame spends on preparing linear_dd for new contacts or fixed nodes.
   * Meanwhile the old contacts answer, and new contacts as if alone. 0, the default: a frame ends each
   * preparation, however long. pal_session_refine prepares zones. */
  uint64_t budget_operations;
  uint32_t zone_rings; /* nonlinear_zone: rings of elements about a patch, 1 .. the pack's. Default 0: all */
  uint32_t zone_iterations; /* nonlinear_zone: Newton iterations of a frame, 1 .. 16. Default 0: 4 */
  /* 1: patches turn with their tools, up to a quarter turn, and tools feel the torque. Only nonlinear_zone
   * answers turns. 0, the default: patches only translate. */
  uint32_t patches_turn;
  uint32_t reserved; /* 0 */
} pal_session_config;

/* Fills in the defaults, and the limits as numbers. Set config->struct_size first. `pack` may be NULL: the
 * config then has one contact, and limits of 0. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_session_fill_config(const pal_pack* pack,
                                                         pal_session_config* config) PAL_NOEXCEPT;

/* Returns the defaults as a value. Compiled into the caller, the function sets the caller's struct size. */
static inline pal_session_config pal_default_session_config(const pal_pack* pack) PAL_NOEXCEPT {
  pal_session_config config = PAL_ZERO;
  config.struct_size = (uint32_t)sizeof config;
  const pal_status filled = pal_session_fill_config(pack, &config);
  (void)filled;
  return config;
}

/* Computes the exact number of arena bytes that a session needs. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_session_required_bytes(const pal_pack* pack,
                                                            const pal_session_config* config,
                                                            size_t* bytes) PAL_NOEXCEPT;

/* Starts a session in `arena`, aligned to 64. There is nothing to free: after the last call the caller may
 * reuse the arena. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_session_init(const pal_pack* pack, const pal_session_config* config,
                                                  void* arena, size_t arena_bytes,
                                                  pal_session** session) PAL_NOEXCEPT;

/* Returns the session's complete config. Set config->struct_size first. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_session_get_config(const pal_session* session,
                                                        pal_session_config* config) PAL_NOEXCEPT;

/* Fixes exactly these contact nodes [count] at zero displacement from the next frame on, beside the model's
 * fixed nodes. Count 0 releases all; `contact_nodes` may then be NULL. A fixed node stays fixed in a contact.
 * PAL_STATUS_MODEL_CANNOT_ANSWER: no model of the session can fix this many. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_session_set_fixed(pal_session* session, const uint32_t* contact_nodes,
                                                       uint32_t count) PAL_NOEXCEPT;

/* Sets gravity for a tilted organ: [3], world axes, m/s^2, up to ten times the scene's gravity. NULL restores
 * the scene's gravity. Contacts still move from rest under the scene's gravity. PAL_STATUS_NO_SUCH_MODEL:
 * gravity may not turn in this pack. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_session_set_gravity(pal_session* session,
                                                         const double* acceleration) PAL_NOEXCEPT;

/* A ball of stiffer or softer tissue, such as a tumour. */
typedef struct pal_inclusion {
  uint32_t struct_size;
  uint32_t reserved; /* 0 */
  double centre[3];  /* at rest, organ frame: m */
  double radius;     /* radius of half the change: m. The change spreads over a mean surface edge */
  double stiffness;  /* relative to the pack's tissue: 0.01 .. 100 */
} pal_inclusion;

/* Places or moves the inclusion, from the next frame on. NULL removes the inclusion. It acts in the nonlinear
 * zone at once, and in the whole organ after an iteration of pal_session_refine. Until then errors are not
 * estimated (docs/response_models.md). Set inclusion->struct_size first. PAL_STATUS_NO_SUCH_MODEL: the
 * session has no nonlinear_zone. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_session_set_inclusion(pal_session* session,
                                                           const pal_inclusion* inclusion) PAL_NOEXCEPT;

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_SESSION_H */
