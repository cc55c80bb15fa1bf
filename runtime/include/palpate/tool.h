/* Tools and haptic frames: poses in, forces, torques and stiffness out. */
#ifndef PALPATE_TOOL_H
#define PALPATE_TOOL_H

#include <palpate/session.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum pal_contact_law {
  PAL_LAW_BONDED = 0, /* the patch follows the tool until pal_tool_release: a grasp */
  PAL_LAW_TOUCH = 1   /* the patch follows the tool while the tool presses, and is released as it comes out */
} pal_contact_law;

/* A tool's hold on a point of the surface (pal_contact). The patch moves as if welded to the tool. */
typedef struct pal_hold {
  uint32_t struct_size;
  pal_contact_law law; /* PAL_LAW_TOUCH needs the pack's surface tree */
  uint32_t sites[3];   /* sites at the triangle's corners; any site if the weight is 0 */
  uint32_t reserved;   /* 0 */
  double weights[3];   /* >= 0, with sum 1 */
  pal_pose unstrained; /* pose of the tool, world, at which this contact has zero displacement */
} pal_hold;

/* Returns a bonded hold of a site. A tool at the world's origin does not displace the patch. */
static inline pal_hold pal_default_hold(uint32_t site) PAL_NOEXCEPT {
  pal_hold hold = PAL_ZERO;
  hold.struct_size = (uint32_t)sizeof hold;
  hold.sites[0] = site;
  hold.weights[0] = 1;
  hold.unstrained.orientation[0] = 1;
  return hold;
}

/* Adds a contact to a tool from the next frame on. Set hold->struct_size first. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_tool_hold(pal_session* session, uint32_t tool,
                                               const pal_hold* hold) PAL_NOEXCEPT;

/* Releases all contacts of a tool. A tool that touches (pal_tool_set_touch) takes hold again only after it
 * has left the surface. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_tool_release(pal_session* session, uint32_t tool) PAL_NOEXCEPT;

/* Lets a tool take hold by itself. A tool without contacts holds the surface point nearest to its tip as soon
 * as the tip is at or below `distance`. A tip deeper than the scene's max_displacement touches nothing. */
typedef struct pal_touch {
  uint32_t struct_size;
  pal_contact_law law;
  double tip[3];   /* centre of the tip in the tool's frame: m */
  double distance; /* distance of the centre from the surface at rest: m, >= 0; the tip's radius, or 0 */
} pal_touch;

/* Sets `touch`; set touch->struct_size first. NULL: the tool no longer takes hold by itself, and keeps its
 * contacts. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_tool_set_touch(pal_session* session, uint32_t tool,
                                                    const pal_touch* touch) PAL_NOEXCEPT;

typedef struct pal_haptic_input {
  uint32_t struct_size;
  uint32_t num_tools;    /* tools 0 .. num_tools - 1 have a new pose; the poses of further tools age */
  const pal_pose* poses; /* [num_tools] world */
  const double* ages;    /* [num_tools] time since each pose was measured: s. NULL: 0 */
  double dt; /* time since the last frame: s, 0 .. 1. More counts as 1. A bad dt counts as the last dt */
  uint32_t result_bytes; /* struct_size of each pal_tool_result: sizeof(pal_tool_result) */
  uint32_t num_results;  /* entries of `results`: tools 0 .. num_results - 1 are written */
} pal_haptic_input;

/* The answer to one tool, world. pal_haptic_input::result_bytes is its struct_size. */
typedef struct pal_tool_result {
  double force[3];           /* force of the tool on the tissue: N. A device plays its negative */
  double torque[3];          /* torque of the tool about its position: N m */
  double stiffness[3][3];    /* d force / d position of the tool, other tools held, before limits: N/m */
  double displacement_error; /* largest estimate of its contacts (pal_contact_result). 1: unknown */
  double force_error;        /* largest estimate of its contacts. 1: unknown */
  uint32_t num_contacts;     /* contacts that the tool holds */
  uint32_t site;             /* site of its first contact */
  pal_model model;           /* model that answered. PAL_MODEL_AUTO: none */
  uint32_t flags;            /* PAL_FLAG_... of its contacts and of the tool */
} pal_tool_result;

/* Computes the forces of all tools, blended over changes, limited and passive: all tools together take no
 * more energy out of the tissue than they put in. Set input->struct_size first. The last valid input replaces
 * invalid input, with a flag, so a frame with valid pointers and sizes always answers. `results`:
 * [num_results], may be NULL. Real-time safe: yes; docs/embedding.md has the cost. */
PAL_NODISCARD PAL_API pal_status pal_haptic_frame(pal_session* session, const pal_haptic_input* input,
                                                  pal_tool_result* results) PAL_NOEXCEPT;

/* Counts of haptic frames since pal_session_init: all, and those in which any tool had a flag. */
typedef struct pal_counters {
  uint32_t struct_size;
  uint32_t reserved; /* 0 */
  uint64_t frames;
  uint64_t switches;     /* frames in which contacts, or the model that answers them, changed */
  uint64_t preparing;    /* PAL_FLAG_PREPARING */
  uint64_t extrapolated; /* PAL_FLAG_EXTRAPOLATED */
  uint64_t bad_input;    /* PAL_FLAG_BAD_INPUT */
  uint64_t stale;        /* PAL_FLAG_STALE */
  uint64_t limited;      /* PAL_FLAG_LIMITED */
  uint64_t reduced;      /* PAL_FLAG_REDUCED */
} pal_counters;

/* Set counters->struct_size first. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_session_get_counters(const pal_session* session,
                                                          pal_counters* counters) PAL_NOEXCEPT;

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_TOOL_H */
