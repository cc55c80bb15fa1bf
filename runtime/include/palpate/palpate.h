/* Palpate runtime: soft tissue that answers a touch at haptic rate.
 *
 * **THE SIGN OF FORCES. Every force and torque here is the one that THE TOOL APPLIES TO THE TISSUE.**
 * **A DEVICE PLAYS ITS NEGATIVE: device_force = -result.force.**
 *
 *   pack.h       pal_pack_open       maps a pack and checks it once; constant afterwards
 *   session.h    pal_session_init    starts a simulation in memory of the caller
 *   tool.h       pal_haptic_frame    poses of tools in; forces, torques and stiffness out
 *   contact.h    pal_contact_frame   displacements of sites in; forces and stiffness out
 *   field.h      pal_visual_frame    displacements of the shown nodes, of the last frame
 *   refinement.h pal_session_refine  prepares nonlinear zones, and refines the organ outside, between frames
 *   recording.h  pal_session_record  records the calls of a session; a replay gives the same bits
 *   status.h     pal_status          errors, and flags of doubtful answers
 *   version.h    pal_version         version of header and library
 *
 * Units. m, N and s if the scene states units. Otherwise "m" and "N" mean the model's own units
 * (pal_pack_info::has_units). The organ frame has the model's axes and origin. pal_session_config::organ
 * places the organ in the world. Tools and gravity use world axes, all other data the organ frame.
 *
 * Threads. A pack: any thread at any time. A session: one thread at a time, but pal_visual_frame and
 * pal_session_refine may each run on one more thread beside any other call.
 *
 * Errors. A call that fails returns its pal_status and changes nothing. A doubtful answer has a flag. NULL is
 * PAL_STATUS_NULL_ARGUMENT unless a comment allows NULL. No call allocates, throws, locks or prints.
 *
 * Growth. A struct that may grow starts with struct_size, which the caller sets to its own sizeof. A member
 * that only one side knows has its default in configs and 0 in results. PAL_STATUS_BAD_STRUCT_SIZE: the size
 * is below the first release's, or a member unknown to the library is not 0. Entries of pal_tool_result
 * arrays have the size pal_haptic_input::result_bytes. A comment marks each struct that does not grow.
 *
 * Floating point. Calls round to nearest, flush subnormal numbers to zero and raise no signal. They restore
 * the caller's mode.
 *
 * docs/embedding.md: threads, budgets, costs, safety, and the reaction to each flag. docs/response_models.md:
 * the choice of a model, and its error.
 */
#ifndef PALPATE_PALPATE_H
#define PALPATE_PALPATE_H

#include <palpate/contact.h>
#include <palpate/field.h>
#include <palpate/pack.h>
#include <palpate/recording.h>
#include <palpate/refinement.h>
#include <palpate/session.h>
#include <palpate/status.h>
#include <palpate/tool.h>
#include <palpate/version.h>

#endif /* PALPATE_PALPATE_H */
