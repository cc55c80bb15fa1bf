/* The refining lane: brings the organ outside of nonlinear zones to equilibrium, between frames or beside them. */
#ifndef PALPATE_REFINEMENT_H
#define PALPATE_REFINEMENT_H

#include <palpate/session.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct pal_refinement {
  uint32_t struct_size;
  uint32_t delivered;  /* 1: this call ended an iteration; the next frame takes it */
  uint32_t waiting;    /* 1: work is left. 0: there is none until a frame has answered */
  uint32_t reserved;   /* 0 */
  uint64_t iterations; /* ended so far */
  double change;       /* the largest component of the displacements that the last iteration changed: m */
} pal_refinement;

/* Works for about so many multiply-adds, in steps that do not stop within a front of the elimination; 0: until an iteration
 * has ended. The next frame of the same contacts takes what it found, and leaves where it has got to for the next
 * iteration. One thread beside those of haptic and visual frames may call this in a loop, or the haptic thread between
 * frames. The session's config must have `refines`, else PAL_STATUS_NO_SUCH_MODEL. `refinement` may be NULL; else set
 * refinement->struct_size first. Real-time safe: yes, but for its length. */
PAL_NODISCARD PAL_API pal_status pal_session_refine(pal_session* session, uint64_t operations,
                                                    pal_refinement* refinement) PAL_NOEXCEPT;

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_REFINEMENT_H */
