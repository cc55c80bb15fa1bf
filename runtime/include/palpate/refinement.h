/* The refining lane: prepares nonlinear zones, and brings the organ outside of them to equilibrium, between frames or beside
 * them. */
#ifndef PALPATE_REFINEMENT_H
#define PALPATE_REFINEMENT_H

#include <palpate/session.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct pal_refinement {
  uint32_t struct_size;
  uint32_t
      delivered; /* 1: this call ended an iteration or prepared a zone. The next frame takes the result */
  uint32_t
      failed; /* 1: this call gave an iteration up, as where tissue would be inverted; the next one goes half as far */
  uint32_t waiting;    /* 1: work is left. 0: there is none until a frame has answered */
  uint64_t iterations; /* delivered so far */
  double
      change; /* of displacements by the iteration, the largest component, if `delivered`: m. 0 for a zone */
} pal_refinement;

/* Works for about so many multiply-adds; 0: until an iteration has ended or a zone is prepared. A step, which is never
 * stopped, is a front of the elimination or one pass over the organ's elements. The next frame takes the result and posts its
 * own state for the next iteration, or other contacts. Nothing else prepares zones: linear_dd answers without these calls. The
 * first call factors the whole organ; make it before a tool touches. One thread beside those of haptic and visual frames may call
 * this in a loop, or the haptic thread between frames; no thread during a replay, which refines by itself.
 * PAL_STATUS_NO_SUCH_MODEL: the session has no zones. `refinement` may be NULL; else set refinement->struct_size first.
 * Real-time safe: yes, but for its length. */
PAL_NODISCARD PAL_API pal_status pal_session_refine(pal_session* session, uint64_t operations,
                                                    pal_refinement* refinement) PAL_NOEXCEPT;

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_REFINEMENT_H */
