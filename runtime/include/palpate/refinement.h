/* The refining lane prepares nonlinear zones, and brings the organ outside of the zones to equilibrium. It
 * runs between frames, or beside frames on its own thread. */
#ifndef PALPATE_REFINEMENT_H
#define PALPATE_REFINEMENT_H

#include <palpate/session.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct pal_refinement {
  uint32_t struct_size;
  /* 1: this call ended an iteration or prepared a zone. The next frame takes the result. */
  uint32_t delivered;
  /* 1: this call rejected an iteration, e.g. to avoid an inverted element. The next step is half as long. */
  uint32_t failed;
  uint32_t waiting;    /* 1: work is left. 0: no work until the next frame */
  uint64_t iterations; /* iterations delivered so far */
  double change; /* largest component of the displacements' change by a delivered iteration: m; else 0 */
} pal_refinement;

/* Works for about this many multiply-adds; 0: until an iteration ends or a zone is prepared. A step is a
 * front of the elimination or one pass over the organ's elements, and is never interrupted. The next frame
 * takes the result, and requests the next iteration or a zone for new contacts. Without these calls no zone
 * is prepared, and linear_dd answers. The first call factors the whole organ: make it before a tool touches.
 * Call it on one more thread in a loop, or on the haptic thread between frames. Do not call it during a
 * replay, which refines by itself. PAL_STATUS_NO_SUCH_MODEL: the session has no zones. `refinement` may be
 * NULL; else set refinement->struct_size first. Real-time safe: yes, except for the duration. */
PAL_NODISCARD PAL_API pal_status pal_session_refine(pal_session* session, uint64_t operations,
                                                    pal_refinement* refinement) PAL_NOEXCEPT;

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_REFINEMENT_H */
