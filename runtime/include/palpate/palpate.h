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
 *   refinement.h pal_session_refine  nonlinear zones to the equilibrium of the whole organ, between frames
 *   recording.h  pal_session_record  every call of a session, to be replayed to the same bits
 *   status.h     pal_status          errors, and flags of doubtful answers
 *   version.h    pal_version         version of header and library
 *
 * Units. m, N, s where the scene states units; otherwise read "m" and "N" as the model's own units
 * (pal_pack_info::has_units). The organ frame has the model's axes and origin. pal_session_config::organ places it in the
 * world. Tools and gravity speak world; all else speaks the organ frame.
 *
 * Threads. A pack: any thread at any time. A session: one thread at a time, but pal_visual_frame and pal_session_refine
 * may each run on one more thread beside any other call.
 *
 * Errors. A call that fails returns its pal_status and changes nothing. A doubtful answer is no error; it has a flag.
 * NULL is PAL_STATUS_NULL_ARGUMENT unless a comment allows it. Nothing allocates, throws, locks or prints.
 *
 * Growth. A struct that may grow starts with struct_size, which the caller sets to its own sizeof. A member that one side
 * does not know has its default in configs and 0 in results. PAL_STATUS_BAD_STRUCT_SIZE: the size is below that of the
 * first release, or a member unknown to the library is not 0. pal_tool_result comes in arrays: its size is
 * pal_haptic_input::result_bytes. The other structs never grow; they say so.
 *
 * Floating point. Calls round to nearest, flush subnormal numbers to zero and raise no signal, whatever the caller's mode,
 * which they restore.
 *
 * docs/embedding.md: threads, budgets, costs, safety, and what to do on each flag. docs/response_models.md: which model,
 * when, and how wrong.
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
