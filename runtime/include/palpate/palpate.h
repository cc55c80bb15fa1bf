/* Palpate runtime: soft tissue that answers a touch at haptic rate.
 *
 *   pal_pack_open      maps an asset pack and checks it once; constant afterwards, shared by any sessions
 *   pal_session_*      all the state of one simulation, in memory that the caller gives
 *   pal_tool_*         what a tool holds, or that it takes hold of what it touches
 *   pal_haptic_frame   poses of the tools in, forces, torques and stiffness out; the fast one
 *   pal_contact_frame  the same for who finds contacts himself: displacements of sites in, forces out
 *   pal_visual_frame   displacements of the nodes that the scene shows, of the last haptic or contact frame
 *
 *        organ.pack (read-only mapping)            caller's memory
 *      +-------------------------------+      +---------------------+
 *      | tables | segments ...         |<-----| session: factor,    |<- poses of tools, each frame
 *      +-------------------------------+      | coefficients, state |-> forces, stiffness, flags
 *                                             +---------------------+-> displacements, when asked
 *
 * Units. SI (metres, newtons, seconds) where the scene states what its numbers mean, else the model's own
 * units: pal_pack_info::metres_per_length_unit tells. The *organ frame* has the model's axes and origin; the
 * *world* is where pal_session_config::organ places it. Tools speak world, all else the organ frame.
 *
 * Threads. A pack may be used from any thread at once. A session belongs to one thread at a time, but for
 * pal_visual_frame: one more thread may call it while the first is in any other call.
 *
 * Errors. Every call that can fail returns a pal_status, and then has changed nothing: outputs are untouched.
 * What is physically doubtful about an answer is not an error but a flag beside the answer. Nothing here
 * allocates, throws, locks or prints; only pal_pack_open and pal_pack_close call the operating system.
 *
 * Files. A pack is read from its mapping: a page that is not in memory is fetched from the disk by whichever
 * frame touches it first; for hard real time call mlock on pal_pack_get_bytes, or open from locked memory.
 * Replace a pack file only by renaming another onto it, as the builder does: a file that is cut short
 * or written into while it is mapped takes the process down, or gives other forces than were checked.
 *
 * Structs that grow. `struct_size`, set by the caller to the sizeof that it was compiled with, lets old
 * callers meet a new library and new callers an old one: members that one side does not know have their
 * default (zero in results). PAL_STATUS_BAD_STRUCT_SIZE where it is below that of the first release, or a
 * member that the library does not know is not zero.
 *
 * Floating point. Whatever the caller's mode, calls round to nearest, flush subnormal numbers to zero and
 * raise no signal; they put the mode back.
 *
 * Handles come from these functions; memory that was not initialised by them is not recognised.
 *
 * NULL pointers are refused with PAL_STATUS_NULL_ARGUMENT unless a comment allows them.
 */
#ifndef PALPATE_PALPATE_H
#define PALPATE_PALPATE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#define PAL_NOEXCEPT noexcept
#define PAL_NODISCARD [[nodiscard]]
#define PAL_ZERO \
  {}
#else
#define PAL_NOEXCEPT
#define PAL_NODISCARD
#define PAL_ZERO \
  { 0 }
#endif

/* The numbers of displacement fields, in packs and in visual frames; all else is double. Double in a library
 * built with PALPATE_FLOAT64=1, which who links it defines too (CMake does it for targets); it opens packs of
 * builders built like it, and no others. */
#if defined(PALPATE_FLOAT64) && PALPATE_FLOAT64
typedef double pal_real;
/* So that the other kind of library does not link. */
#define pal_visual_frame pal_visual_frame_float64
#define pal_pack_compute_normals pal_pack_compute_normals_float64
#else
typedef float pal_real;
#endif

/* Values are pinned; new ones are added at the end of their group of ten. */
typedef enum pal_status {
  PAL_STATUS_OK = 0,
  /* the call */
  PAL_STATUS_NULL_ARGUMENT = 10,
  PAL_STATUS_BAD_STRUCT_SIZE = 11, /* struct_size is not set, or asks for more than this library knows */
  PAL_STATUS_BAD_ARGUMENT = 12,    /* a value outside its documented range */
  PAL_STATUS_NOT_FINITE = 13,      /* a NaN or an infinity came in, or a place beyond 1e100 */
  PAL_STATUS_NO_SUCH_SITE = 14,
  PAL_STATUS_NO_SUCH_NODE = 15,
  PAL_STATUS_NO_SUCH_MODEL = 16, /* the pack does not carry the response model asked for */
  PAL_STATUS_MODEL_CANNOT_ANSWER =
      17, /* several contacts, fixed nodes or given forces, and no linear_dd or zone to answer them */
  PAL_STATUS_NO_SUCH_TOOL = 18, /* at or beyond the session's max_tools */
  PAL_STATUS_ALREADY_USED = 19, /* recording starts with a session to which nothing has happened yet */
  /* memory */
  PAL_STATUS_ARENA_TOO_SMALL = 20,
  PAL_STATUS_ARENA_MISALIGNED = 21,
  PAL_STATUS_CAPACITY_EXCEEDED = 22, /* more than the session's config, or the buffer, allows */
  /* the file */
  PAL_STATUS_FILE_NOT_FOUND = 30,
  PAL_STATUS_FILE_NOT_READABLE = 31,
  /* the pack */
  PAL_STATUS_NOT_A_PACK = 40,
  PAL_STATUS_WRONG_VERSION = 41, /* a pack of another format version: build it again */
  PAL_STATUS_TRUNCATED = 42,
  PAL_STATUS_CORRUPT_TABLES = 43,  /* the FlatBuffer does not verify */
  PAL_STATUS_CORRUPT_CONTENT = 44, /* tables that contradict each other or hold impossible values */
  PAL_STATUS_BAD_CHECKSUM = 45,
  PAL_STATUS_OTHER_PRECISION = 46, /* its fields are float64 and this library reads float32, or the reverse */
  /* the recording */
  PAL_STATUS_NOT_A_RECORDING = 50,
  PAL_STATUS_CORRUPT_RECORDING = 51,
  PAL_STATUS_RECORDING_OF_OTHER_PACK = 52,
  PAL_STATUS_NOT_RECORDING = 53,
  PAL_STATUS_RECORDING_OF_OTHER_BUILD = 54
} pal_status;

/* One English sentence without a full stop; never NULL. Real-time safe: yes. */
const char* pal_status_text(pal_status status) PAL_NOEXCEPT;

typedef enum pal_model {
  /* polynomial_dd and affine_site where the pack has them and they can answer the contacts, else nonlinear_zone, else
   * linear_dd */
  PAL_MODEL_AUTO = 0,
  PAL_MODEL_LINEAR = 1, /* linear_dd: any contacts, nodes fixed while running */
  /* polynomial_dd: nonlinear, one contact, no run-time fixed nodes. Where a site was not sampled affine_site answers, and the
   * result says so. */
  PAL_MODEL_POLYNOMIAL = 2,
  /* nonlinear_zone: nonlinear, up to 8 contacts and 32 run-time fixed nodes, no turned gravity. Its answer depends on the
   * frames before: each goes on from the last. Its force is the gradient of the stored energy but for some 1e-4 of it,
   * more where several contacts pull against each other, and its stiffness symmetric; of contacts near each other it leaves
   * out what the elements next to their zone add, some 1e-3. */
  PAL_MODEL_ZONE = 3,
  /* affine_site: as polynomial_dd, at sites that were not sampled: their exact derivatives at rest, to fifth order. A site that
   * was sampled answers with its own polynomial, under this name. */
  PAL_MODEL_AFFINE = 4
} pal_model;

/* What is doubtful about an answer. */
enum {
  /* Displacement beyond what was sampled. Energy and field are continued along the ray by their second and
   * first order expansion at the boundary; out of a surface where only inward displacements were sampled, the
   * nonlinear part fades out. nonlinear_zone: also a load beyond what its exterior is made for, or at which the organ
   * outside is about to give way; of several contacts, also a load at which the error was as large as the displacement in
   * the pack's survey. */
  PAL_FLAG_EXTRAPOLATED = 1 << 0,
  /* Displacement beyond four times that (linear_dd, and nonlinear_zone where it is not by a given force: a million times
   * the scene's largest; zones follow as far as they find a way), or a patch turned by more than a quarter: the answer
   * is for the shortened one; polynomials' force goes on as the gradient of an energy that rises along the ray as it
   * does there. */
  PAL_FLAG_CLAMPED = 1 << 1,
  /* The nonlinear models of the pack cannot answer these contacts, or with nodes fixed; linear_dd did. */
  PAL_FLAG_LINEAR_FALLBACK = 1 << 2,
  /* Two contacts hold the same node, or would at some of the corners that they are between: it follows their mean. */
  PAL_FLAG_OVERLAPPING = 1 << 3,
  /* Contact nodes so close that the compliance is singular to rounding: a spring of a billionth of a node's
   * own compliance was added to it, or a stiffer one. Or given forces that cannot all act: on a contact that
   * cannot move, or on contacts that hold the same nodes. */
  PAL_FLAG_ILL_CONDITIONED = 1 << 4,
  /* Of tools. The pose was not finite, beyond 1e100 or no rotation, or dt or the age absurd: the last good
   * one was used instead. */
  PAL_FLAG_BAD_INPUT = 1 << 5,
  /* The input is older than stale_seconds: the force ramps to zero, or back from it. */
  PAL_FLAG_STALE = 1 << 6,
  /* Force and torque were cut to a limit of theirs, or of their rates. */
  PAL_FLAG_LIMITED = 1 << 7,
  /* Contacts, fixed nodes or the model have changed: the jump of the force is being faded out. */
  PAL_FLAG_BLENDING = 1 << 8,
  /* The tool touched, and no further contact can be held or answered. */
  PAL_FLAG_NO_ROOM = 1 << 9,
  /* The model for the contacts held, or the nodes fixed, is still being made ready (budget_seconds): what was
   * answered before goes on, and contacts that are new have no force yet. */
  PAL_FLAG_PREPARING = 1 << 10,
  /* The model gave no finite force, as that of a damaged pack that was not verified may: the last one is
   * given. */
  PAL_FLAG_NOT_FINITE = 1 << 11,
  /* Of tools. Contacts, fixed nodes or the model have changed, or contacts have not come to rest, and the tools
   * would get out more energy than they have put in: force and stiffness are less than the model's, see
   * pal_haptic_frame. */
  PAL_FLAG_REDUCED = 1 << 12,
  /* The contact is at a point between sites, and one of more than three: the site of the largest weight answered instead,
   * or, of a contact of nonlinear_zone far from all others, the zone as if it were alone. */
  PAL_FLAG_NEAREST_SITE = 1 << 13,
  /* nonlinear_zone has not come to rest at this displacement: it had further to go than a frame allows, the next step
   * would have turned an element inside out, or a long one led to where short ones do not. It goes on in the next
   * frame, or, of contacts that have jammed tissue between them for five frames, and of one that has brought an answer from
   * beyond the scene that the organ has not, anew from rest. Where that way jams, too, contacts stay, with forces and
   * stiffness that may be any (max_force in pal_session_config), until they are to be elsewhere. The contact's displacement
   * in the result is where it has got to. On the way elements may be all but inverted: where forces are more than twice
   * what the last balance and its stiffness tell of, those are given instead, with that stiffness. Contact frames move the
   * same zone as haptic frames. */
  PAL_FLAG_UNCONVERGED = 1 << 14
};

/* ---------------------------------------------------------------- pack -- */

typedef struct pal_pack pal_pack; /* opaque; lives in storage of the caller */

enum {
  PAL_PACK_STORAGE_BYTES = 2048,
  /* nonlinear_zone: its stiffness is that of at most so many frames ago, unless the contacts jump */
  PAL_ZONE_STIFFNESS_FRAMES = 24
};

typedef enum pal_verify {
  /* Everything: header, FlatBuffer verifier, every index and every number within bounds, checksum over the
   * whole file. Cost: a few passes over the file at memory speed. */
  PAL_VERIFY_ONCE = 0,
  /* What no frame could bear: header, FlatBuffer verifier, sizes of segments, every index. Numbers and
   * checksum are taken on trust, as of a pack that `palpate verify` accepted where it is kept: one that was
   * damaged since may give forces that mean nothing or are not finite, but no access outside of it. Cost: a
   * pass over the indices. */
  PAL_VERIFY_NEVER = 1
} pal_verify;

/* Maps the file read-only and checks it. `storage`: PAL_PACK_STORAGE_BYTES bytes aligned to 16, the caller's
 * until pal_pack_close. Real-time safe: no. */
PAL_NODISCARD pal_status pal_pack_open(const char* path, pal_verify verify, void* storage,
                                       size_t storage_bytes, pal_pack** pack) PAL_NOEXCEPT;

/* The same on bytes in memory, aligned to 64, which must outlive the pack and not change. Real-time safe: no.
 */
PAL_NODISCARD pal_status pal_pack_open_memory(const void* bytes, size_t num_bytes, pal_verify verify,
                                              void* storage, size_t storage_bytes,
                                              pal_pack** pack) PAL_NOEXCEPT;

/* Unmaps. No session on the pack may be used afterwards. NULL is allowed. Real-time safe: no. */
void pal_pack_close(pal_pack* pack) PAL_NOEXCEPT;

typedef struct pal_pack_info {
  uint32_t struct_size;
  uint32_t num_nodes; /* packed nodes: the rows of pal_visual_frame */
  uint32_t num_triangles;
  uint32_t num_sites;         /* where a tool can take hold */
  uint32_t num_contact_nodes; /* nodes that can be held or fixed */
  uint32_t max_patch_nodes;   /* of any site */
  uint32_t max_contacts;      /* that the scene asks for */
  uint32_t has_linear;        /* 1 = the pack carries the model */
  uint32_t has_polynomial;
  uint32_t polynomial_degree;    /* of the displacement field, the highest of any site; 0 without the model */
  uint32_t has_units;            /* 1 = this API speaks metres and newtons */
  double metres_per_length_unit; /* 1 without units */
  double newtons_per_force_unit;
  double max_displacement; /* that the scene asks for: m, or length unit */
  double tip_radius;
  double mean_surface_edge;
  double gravity[3]; /* the scene's, model's axes, length in metres where the scene states units; 0 without */
  uint32_t has_gravity;
  uint32_t gravity_may_turn; /* 1 = pal_session_set_gravity answers */
  uint32_t zone_rings;       /* that the pack carries of nonlinear_zone, about some sites one more; 0: none */
  uint32_t reserved;         /* 0 */
} pal_pack_info;

/* Set info->struct_size = sizeof(pal_pack_info) first. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_pack_get_info(const pal_pack* pack, pal_pack_info* info) PAL_NOEXCEPT;

/* The packed geometry, in place: valid until pal_pack_close. Positions are in model length units. */
typedef struct pal_geometry {
  uint32_t struct_size;
  uint32_t num_nodes;
  uint32_t num_triangles;
  const int32_t* labels;     /* [num_nodes] labels of the model file, ascending */
  const double* positions;   /* [num_nodes][3] */
  const uint32_t* triangles; /* [num_triangles][3] counter-clockwise from outside */
  /* [num_nodes][3] where gravity lets the organ rest; without it, `positions` */
  const double* rest_positions;
} pal_geometry;

/* Set geometry->struct_size first. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_pack_get_geometry(const pal_pack* pack, pal_geometry* geometry) PAL_NOEXCEPT;

/* Site at the node with this label of the model file. Cost: a binary search. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_pack_find_site(const pal_pack* pack, int32_t node_label,
                                            uint32_t* site) PAL_NOEXCEPT;

/* Contact node (for pal_session_set_fixed) with this label. Cost: a binary search. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_pack_find_contact_node(const pal_pack* pack, int32_t node_label,
                                                    uint32_t* contact_node) PAL_NOEXCEPT;

/* Packed node at the centre of a site. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_pack_get_site_node(const pal_pack* pack, uint32_t site,
                                                uint32_t* node) PAL_NOEXCEPT;

/* The bytes of the pack, for tools that read the tables themselves. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_pack_get_bytes(const pal_pack* pack, const void** bytes,
                                            size_t* num_bytes) PAL_NOEXCEPT;

/* ------------------------------------------------------------- session -- */

typedef struct pal_session pal_session; /* opaque; lives in the caller's arena */

/* A place and an orientation: x in the frame that is placed becomes R x + position. */
typedef struct pal_pose {
  double position[3];
  double orientation[4]; /* R as a unit quaternion w, x, y, z */
} pal_pose;

/* Nanoseconds that have passed since a time of its own choosing. */
typedef uint64_t (*pal_clock)(void* user);

typedef struct pal_session_config {
  uint32_t struct_size;
  /* Held at once, by all tools together: 1 .. 64. Of a pack made for one contact, errors of several are not known:
   * pal_contact_result::displacement_error is 1. */
  uint32_t max_contacts;
  uint32_t max_fixed; /* nodes fixed while running: 0 .. 1024 */
  pal_model model;
  uint32_t max_tools; /* 0 .. 16 */
  /* Nodes that pal_session_request_nodes may name: 0 .. the pack's. */
  uint32_t max_requested;
  pal_pose organ; /* in the world */
  /* When what answers changes, each tool's force goes on from where it was and the difference fades out over
   * this time (s, 0: it jumps), so that a device does not kick. */
  double blend_seconds;
  /* From this age of its input on a tool's force ramps to zero over ramp_seconds, and back when input comes
   * (s; 0: never). */
  double stale_seconds;
  double ramp_seconds;
  /* Limits of each tool; 0: none. Where one of them is passed, force and torque are scaled alike. Fading out
   * (stale_seconds) is not held back by the rates. */
  double max_force;       /* N */
  double max_torque;      /* N m */
  double max_force_rate;  /* N/s */
  double max_torque_rate; /* N m/s */
  /* Other contacts or fixed nodes need another inverse of linear_dd, up to 27 of them where contacts are between
   * sites (pal_contact), or another nonlinear zone, or both, one after the other. A haptic frame spends this time
   * on it (s), and at most 9 n^2 multiply-adds more, n = 3 x the nodes held and fixed. Of a zone that is a step more:
   * 4 m^2, m = 3 x its nodes, or what it takes to list the nodes of a contact, to fetch as many blocks of the
   * compliance as a patch and the zone have nodes, or its boundary and those of the zones before, or to evaluate its
   * elements once (assemble them, where they share volumes); and m^3 / 6 where it is pushed so far in a frame that its
   * tangent no longer does. Until it is ready, over as many frames as that takes, the contacts of before answer (those
   * let go stay where they were), and tools are PAL_FLAG_PREPARING. What was begun is finished first, so that contacts
   * which change all the time are answered too. Contact frames for contacts of their own take its place. 0: it is made
   * ready at once, however long that takes. */
  double budget_seconds;
  /* What budget_seconds is divided by: the time of one multiply-add of such an inverse. 0: pal_session_init
   * finds out, with `clock`, and pal_session_get_config tells. Frames never read a clock: the same session
   * answers the same. */
  double seconds_per_operation;
  pal_clock clock; /* may be NULL where there is no budget, or where the time is given */
  void* clock_user;
  /* nonlinear_zone: rings of elements about each patch, 1 .. those of the pack (0: all of them), one more where the
   * pack has one more, and Newton iterations of a frame, 1 .. 16 (0: 4). What pairs of contacts add to each other a pack has
   * for all of its rings: for several contacts in fewer, build one of no more. */
  uint32_t zone_rings;
  uint32_t zone_iterations;
  /* 1: patches turn with what holds them, and tools feel the torque that this takes; 0: they only move. A tool that goes beyond a
   * quarter turn from where it took hold slips: the patch stays turned by that much. nonlinear_zone alone can, and PAL_MODEL_AUTO
   * then answers by it; PAL_STATUS_NO_SUCH_MODEL where the session has none. Costs twice the rows of a contact in its equations. */
  uint32_t patches_turn;
  uint32_t reserved; /* 0 */
} pal_session_config;

/* One contact for each the scene asks for, no fixed or requested nodes, PAL_MODEL_AUTO, four tools, the organ
 * where the model has it, 10 ms to blend, stale from 50 ms on and silent 50 ms later, no limits of force.
 * `pack` may be NULL: then one contact. */
static inline pal_session_config pal_default_session_config(const pal_pack* pack) PAL_NOEXCEPT;

/* The same into a struct of the caller's own size: set config->struct_size first. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_session_fill_config(const pal_pack* pack,
                                                 pal_session_config* config) PAL_NOEXCEPT;

/* Exact number of arena bytes that a session needs. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_session_required_bytes(const pal_pack* pack, const pal_session_config* config,
                                                    size_t* bytes) PAL_NOEXCEPT;

/* Makes a session at the start of `arena`, aligned to 64. The arena is the caller's again when the session is
 * no longer used: there is nothing to free. Cost: clears the arena; a millisecond to find out
 * seconds_per_operation. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_session_init(const pal_pack* pack, const pal_session_config* config, void* arena,
                                          size_t arena_bytes, pal_session** session) PAL_NOEXCEPT;

/* Fixes exactly these contact nodes from the next frame on, or as soon as budget_seconds lets (zero
 * displacement), in addition to the model's own fixed nodes; count 0 releases all. Zhong et al. 2005 eqs.
 * (20), (21). A node that a contact holds at the same time follows the fixing, which bears its force. nonlinear_zone answers with up to
 * 32 of them, nonlinear about contacts and, where there are any, of first order elsewhere; linear_dd with any.
 * PAL_STATUS_MODEL_CANNOT_ANSWER where the session has no model for so many. Cost: the next haptic frame
 * takes them in, as if all contacts were new where linear_dd answers them between sites; of a zone they are boundary nodes.
 * Real-time safe: yes. */
PAL_NODISCARD pal_status pal_session_set_fixed(pal_session* session, const uint32_t* contact_nodes,
                                               uint32_t count) PAL_NOEXCEPT;

/* Gravity as the device is tilted, world axes (its length in metres where the scene states units), up to ten
 * times the scene's; NULL: the scene's again. The organ sags anew to first order, and tools feel it;
 * displacements of contacts stay those from rest under the scene's gravity. PAL_STATUS_NO_SUCH_MODEL where
 * the scene does not let it turn. polynomial_dd answers the scene's gravity alone, linear_dd any. Cost: 3 (3
 * c + n) multiply-adds more in each frame, between sites for each way to choose the corners. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_session_set_gravity(pal_session* session,
                                                 const double* acceleration) PAL_NOEXCEPT;

/* A ball of tissue that is stiffer or softer than the pack's: a tumour that moves, a lesion that hardens. */
typedef struct pal_inclusion {
  uint32_t struct_size;
  uint32_t reserved; /* 0 */
  double centre[3];  /* where the organ rests, in its own axes: m, or length unit */
  double radius;     /* of half the change: it comes about over a mean edge of the surface */
  double stiffness;  /* of the pack's tissue there: 0.01 .. 100 */
} pal_inclusion;

/* Puts it there, or moves it, from the next frame on; NULL: takes it away. It acts in the nonlinear zones that it reaches, as
 * if their elements were of such tissue and rested where they do; what lies outside of a zone answers as the pack has it,
 * which leaves an error where the zone does not hold all of the inclusion: some percent of the force (README), but 15 to 40
 * percent of it beside full solves of a block, of balls 30 to 100 times as stiff of which two rings held half. None is estimated. With
 * PAL_MODEL_AUTO nonlinear_zone answers while there is one; PAL_STATUS_NO_SUCH_MODEL where the session has none. Tools feel it
 * move, and the energy that this brings is its own. Set inclusion->struct_size first. Cost: the next frame of a
 * zone that it reaches evaluates its elements three times more, and where the stiffness there changes by half makes the tangent
 * anew. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_session_set_inclusion(pal_session* session,
                                                   const pal_inclusion* inclusion) PAL_NOEXCEPT;

/* ------------------------------------------------------------ contacts -- */

/* The patch of a site, held and moved as one: along each axis of the organ frame its displacement is given,
 * or the force on it. Of the other of the two numbers nothing is read.
 *
 * A point of the surface between sites answers as the blend of the sites at the corners of its triangle, each to
 * the same displacement: energy, force, stiffness and field are their means with the point's weights, so that
 * both force and field are continuous as the point slides. polynomial_dd does so for one contact, linear_dd for up to three at
 * once: their mean is over all ways to choose a corner for each. Of four and more every one acts at its site of the largest weight, and is
 * PAL_FLAG_NEAREST_SITE. nonlinear_zone answers about the site of the largest weight, or nearly, and adds what polynomial_dd, or
 * linear_dd where the pack has no other, says of the contact alone at the point instead of that site; where the site
 * changes the answer jumps by what those models are wrong by. To two or three contacts, and where nodes are fixed, it adds
 * what linear_dd says of all of them at their points instead of those sites, with no estimate of the error; one of more is moved as
 * if it were alone, or, where it shares its zone or nodes are fixed, acts at that site, and is
 * PAL_FLAG_NEAREST_SITE. This struct does not grow. */
typedef struct pal_contact {
  uint32_t site;
  double displacement[3]; /* of the patch from rest: m, or length unit */
  uint32_t force_axes;    /* bit 0, 1, 2: the force is given along x, y, z; 0: the displacement is */
  double force[3];        /* that the tool applies to the tissue: N, or force unit */
  /* At a point between sites, the other two corners and their weights, >= 0; that of `site` is what their sum
   * leaves of 1. Zero: at `site`. Those of weight 0 may name any site. */
  uint32_t neighbours[2];
  double neighbour_weights[2];
} pal_contact;

typedef struct pal_contact_result {
  double force[3]; /* that the tool must apply to the tissue: N, or force unit. A device plays its negative */
  double displacement[3]; /* of the patch: as given, or what the given force makes of it */
  /* d force / d displacement of this contact, all others held where they are; symmetric. Of the shortened
   * displacement where the answer is PAL_FLAG_CLAMPED. Of nonlinear_zone as it was up to
   * PAL_ZONE_STIFFNESS_FRAMES frames ago, and 0 in a frame in which contacts begin anew at rest; contacts
   * whose zones share no node are not held, but follow. */
  double stiffness[3][3];
  pal_model model; /* that answered */
  uint32_t flags;  /* PAL_FLAG_... */
  /* Estimate: the largest error of any shown node over |displacement|: what 95 % of such errors at that |displacement|
   * stay below, by the pack's survey (ErrorSurvey in schemas/pack.fbs), and of nonlinear_zone what its iterations leave
   * besides, as while contacts move. Of several contacts it is over the largest |displacement| among them, the same for
   * all, and grows with their forces and with the sum of their squared displacements. 1 where nothing was measured, of
   * several contacts by linear_dd, and of all of them where one has a flag. */
  double displacement_error;
  double force_error; /* the same of |error of force| / |force| */
} pal_contact_result;

/* Forces and stiffness for exactly these contacts (count 0: the tissue is at rest), without tools: no
 * history but in the rounding and in a nonlinear zone, no blending, no limits. What tools hold is not among
 * them and comes back with the next haptic frame (under a budget: as soon as it is ready again). `results`:
 * count entries, may be NULL. Cost in multiply-adds, with n = 3 x the nodes held by c contacts and fixed: polynomial_dd
 * of degree 3 about 200, of degree 7 700; linear_dd with the contacts of the frame before 3 c (3 c + n), and g^3 / 6
 * + g n for g axes of given force; where the set has changed 6 n^2 more for each node that has come, 3 n^2 for each
 * that has gone and up to 10 n^2 for all, but never more than 2 n^3 / 3 + 10 n^2. Given forces are answered by
 * nonlinear_zone, within the same iterations, or linear_dd. At a point between sites: that of its corners, of
 * linear_dd alone 9 for each node of their patches, and of several contacts the above for each way to choose their
 * corners; those that were made ready lately are kept, and a contact that slides into the next triangle needs at most
 * a third of them anew. nonlinear_zone: for each Newton iteration some 4 m^2 a zone, m = 3 x its nodes, 9 for each
 * pair of nodes on the boundaries of two zones, and a frame 18 for each of a boundary and next to it where contacts are
 * near each other; m^3 / 60 + m^2 and 300 for each element of four nodes a frame that moves, for the stiffness of some
 * frames later; ten times as much where it jumps, and 7 / 6 b^3 + m^3 / 3 more where it is new, b = 3 x its boundary
 * nodes, those fixed while running among them; between sites that of what moves
 * it besides: of one contact of its corners, of two or three and beside fixed nodes of linear_dd between sites for
 * each iteration, and where the places are new. Real-time safe: yes, for the n that the budget allows. */
PAL_NODISCARD pal_status pal_contact_frame(pal_session* session, const pal_contact* contacts, uint32_t count,
                                           pal_contact_result* results) PAL_NOEXCEPT;

/* How the patches of contacts are turned about their points (pal_contact), in contact frames from the next one on: unit quaternions
 * w, x, y, z, [count][4], in the organ frame, of contact 0, 1 ...; those without one, and all with count 0, are not. What is beyond a
 * quarter turn is shortened, and PAL_FLAG_CLAMPED. Error estimates are 1 where something is turned; linear_dd, where it has to stand
 * in (PAL_FLAG_LINEAR_FALLBACK), turns nothing. PAL_STATUS_NO_SUCH_MODEL where patches do not turn
 * (pal_session_config::patches_turn), PAL_STATUS_BAD_ARGUMENT for what is no unit quaternion, PAL_STATUS_CAPACITY_EXCEEDED beyond
 * max_contacts. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_session_set_orientations(pal_session* session, const double* orientations,
                                                      uint32_t count) PAL_NOEXCEPT;

/* With pal_contact_result::stiffness, and by_displacement transposed as d force / d rotation, the 6 x 6 stiffness, organ frame. Rotations
 * are small ones about its axes, on top of what the patch is turned by; so by_rotation is symmetric only without a torque. */
typedef struct pal_contact_torque {
  uint32_t struct_size;
  uint32_t reserved;            /* 0 */
  double torque[3];             /* of the patch about its point where it has moved to: N m */
  double by_displacement[3][3]; /* d torque / d displacement: N */
  double by_rotation[3][3];     /* N m */
} pal_contact_torque;

/* Of a contact of the last frame, a contact frame: tools feel it in pal_tool_result::torque. PAL_STATUS_MODEL_CANNOT_ANSWER where the last
 * frame was none, or not answered by nonlinear_zone; PAL_STATUS_BAD_ARGUMENT where it had no such contact. Set torque->struct_size
 * first. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_session_get_torque(const pal_session* session, uint32_t contact,
                                                pal_contact_torque* torque) PAL_NOEXCEPT;

/* --------------------------------------------------------------- tools -- */

typedef enum pal_contact_law {
  PAL_LAW_BONDED = 0, /* the patch follows the tool until pal_tool_release: a grasp */
  /* The same while the tool presses: it lets go a hundredth of an edge above where it took hold, or outside
   * of the surface at rest wherever its tip (pal_touch) comes out. */
  PAL_LAW_TOUCH = 1
} pal_contact_law;

/* A point of the surface, as weights of the sites at the corners of its triangle. */
typedef struct pal_surface_point {
  uint32_t sites[3];
  uint32_t reserved;  /* 0 */
  double weights[3];  /* >= 0, of sum 1 */
  double position[3]; /* at rest, organ frame */
  double normal[3];   /* out of the tissue, unit */
  /* Of the place that was asked for, negative inside the tissue. The sign is right where the nearest point
   * that can be touched is also the nearest of the organ's whole surface. */
  double distance;
} pal_surface_point;

/* Nearest point of the surface at rest that can be touched: of the triangles whose corners are all sites, and
 * of sites without such a triangle. PAL_STATUS_NO_SUCH_MODEL where the pack was built without the tree that
 * this needs. `position`: organ frame, within 1e15 length units. Cost: about a microsecond on a surface of
 * thousands of triangles. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_pack_find_surface_point(const pal_pack* pack, const double position[3],
                                                     pal_surface_point* point) PAL_NOEXCEPT;

/* The contact at such a point, moved by `displacement` (m, or length unit). */
static inline pal_contact pal_contact_at(const pal_surface_point* point,
                                         const double displacement[3]) PAL_NOEXCEPT;

/* How a tool holds a place of the surface, which answers as pal_contact says, and moves as if it were welded to
 * the tool. */
typedef struct pal_hold {
  uint32_t struct_size;
  pal_contact_law law;
  uint32_t sites[3];   /* as in pal_surface_point */
  uint32_t reserved;   /* fills a gap */
  double weights[3];   /* those of weight 0 may name any site */
  pal_pose unstrained; /* of the tool, in the world, at which this contact does not move the tissue */
} pal_hold;

/* PAL_LAW_BONDED at a site, unstrained at the world's origin: the tool's position is its displacement. */
static inline pal_hold pal_default_hold(uint32_t site) PAL_NOEXCEPT;

/* One more contact for a tool, from the next frame on. PAL_LAW_TOUCH needs the surface's tree, as above.
 * Real-time safe: yes. */
PAL_NODISCARD pal_status pal_tool_hold(pal_session* session, uint32_t tool,
                                       const pal_hold* hold) PAL_NOEXCEPT;

/* Lets go of all that the tool holds; one that touches takes hold again only after it has been off the
 * surface. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_tool_release(pal_session* session, uint32_t tool) PAL_NOEXCEPT;

/* A tool that takes hold of what it touches. While it holds nothing, each haptic frame looks for the surface
 * point nearest to its tip, and holds it as soon as the tip is at or below `distance`, unstrained at that
 * pose. Once it has let go it must first have been above it. A tip deeper than the scene's max_displacement
 * touches nothing: it is beyond what can be touched. */
typedef struct pal_touch {
  uint32_t struct_size;
  pal_contact_law law;
  double tip[3];   /* in the tool's frame */
  double distance; /* of the tip's centre from the surface at rest: its radius, or 0 */
} pal_touch;

/* NULL: it no longer does; what it holds it keeps. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_tool_set_touch(pal_session* session, uint32_t tool,
                                            const pal_touch* touch) PAL_NOEXCEPT;

typedef struct pal_haptic_input {
  uint32_t struct_size;
  uint32_t num_tools;    /* of which there is a pose: tools 0 .. num_tools - 1. The last of the others age */
  const pal_pose* poses; /* [num_tools] world */
  const double* ages;    /* [num_tools] s since each pose was measured; NULL: just now */
  double dt;             /* s since the last frame, 0 .. 1; more counts as 1 */
  uint32_t result_bytes; /* sizeof(pal_tool_result), as the caller knows it */
  uint32_t num_results;  /* for which there is room: those of tools 0 .. num_results - 1 are written */
} pal_haptic_input;

typedef struct pal_tool_result {
  double force[3];           /* as in pal_contact_result, of all its contacts together, world */
  double torque[3];          /* the same about the tool's position: N m, or units of the model */
  double stiffness[3][3];    /* d force / d position of the tool, the other tools held; before limits */
  double displacement_error; /* the largest of its contacts', as in pal_contact_result */
  double force_error;
  uint32_t num_contacts; /* that it holds */
  uint32_t site;         /* where the first of them acts */
  pal_model model;       /* that answered; PAL_MODEL_AUTO: none, for it holds nothing that is ready */
  uint32_t flags;        /* PAL_FLAG_... of its contacts and its own */
} pal_tool_result;

/* Forces of all tools. The tools of a session together get no more energy out of the tissue than they have
 * put in since they last held nothing or it was at rest (but for 0.3 % of the most that they had put in):
 * where a switch would give them more, or contacts that have not come to rest (PAL_FLAG_UNCONVERGED),
 * the forces of all are multiplied by one factor, which falls while they are on their
 * way out and rises to 1 while they are on their way in, and a blend that drives a tool ends within a few
 * frames. Contacts that are taken hold of under strain bring its energy with them; those that budget_seconds
 * delays do not. Error estimates are those of the whole force. Input that makes no sense is replaced by the
 * last that did, and flagged: with valid pointers and sizes a frame always answers. `results`: num_results
 * entries, may be NULL; while the frame runs they are in the making, so hand copies to other threads. Cost:
 * that of pal_contact_frame for the contacts held, 0.1 us, and 0.02 us for each contact; 1 to 2 us for each
 * tool that looks for something to touch, more where much is equally near. Real-time safe: yes, as
 * pal_contact_frame. */
PAL_NODISCARD pal_status pal_haptic_frame(pal_session* session, const pal_haptic_input* input,
                                          pal_tool_result* results) PAL_NOEXCEPT;

/* Haptic frames so far, and those of them in which some tool was so flagged. */
typedef struct pal_counters {
  uint32_t struct_size;
  uint32_t reserved; /* 0 */
  uint64_t frames;
  uint64_t switches; /* contacts were taken hold of or let go, or what answers them changed */
  uint64_t preparing;
  uint64_t extrapolated;
  uint64_t bad_input;
  uint64_t stale;
  uint64_t limited;
  uint64_t reduced;
} pal_counters;

/* Set counters->struct_size first. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_session_get_counters(const pal_session* session,
                                                  pal_counters* counters) PAL_NOEXCEPT;

/* The session's config, completed. Set config->struct_size first. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_session_get_config(const pal_session* session,
                                                pal_session_config* config) PAL_NOEXCEPT;

/* ----------------------------------------------------------- recording -- */

/* Writes every call that changes the session, its input and a digest of its answer, into a buffer of the
 * caller, from now on: the session's own start first, so nothing may have happened to it yet. A haptic frame
 * takes 32 bytes, 56 for each pose, 8 for each age and 24 for each tool. `buffer`: aligned to 8, the caller's
 * again after pal_session_stop_recording. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_session_record(pal_session* session, void* buffer,
                                            size_t buffer_bytes) PAL_NOEXCEPT;

/* `bytes`: of the recording, which may then be saved as it is. `complete`: 0 where the buffer was full before
 * the end, and what is in it can still be replayed; may be NULL. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_session_stop_recording(pal_session* session, size_t* bytes,
                                                    uint32_t* complete) PAL_NOEXCEPT;

/* The config of the session that was recorded: a session to replay it with is made with it. Set
 * config->struct_size first. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_recording_get_config(const void* recording, size_t bytes,
                                                  pal_session_config* config) PAL_NOEXCEPT;

/* Where a replay has got to. All zero, but for struct_size, at its start. */
typedef struct pal_replay {
  uint32_t struct_size;
  uint32_t ended;    /* 1: there is no further call */
  uint64_t offset;   /* of the next call, bytes */
  uint64_t frames;   /* haptic and contact frames so far */
  double seconds;    /* dt of the haptic frames so far, as they took it */
  uint32_t diverged; /* 1: the last call's answer was not, to the bit, the one recorded */
  uint32_t index;    /* the first tool, or contact, whose force was another; 0 if none */
  double recorded_force[3];
  double force[3];
} pal_replay;

/* Makes the next recorded call on a session with the recorded config that went through those before and no
 * others. On the same build, pack and kind of processor the answer is the same to the bit. Real-time safe: as
 * the call. */
PAL_NODISCARD pal_status pal_session_replay(pal_session* session, const void* recording, size_t bytes,
                                            pal_replay* replay) PAL_NOEXCEPT;

/* ------------------------------------------------------------- picture -- */

/* Displacements of all packed nodes from the mesh (pal_geometry::positions), gravity's among them, organ
 * frame, under the contacts of the last haptic or contact frame that has returned: node i's three numbers are
 * written at (char*)displacements + i * stride_bytes, stride_bytes >= 3 sizeof(pal_real). m, or length unit.
 * The memory is written and never read: it may be a graphics card's. Cost: one pass over the coefficients in
 * use; the haptic thread never waits for it. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_visual_frame(pal_session* session, pal_real* displacements,
                                          size_t stride_bytes) PAL_NOEXCEPT;

/* From now on visual frames write these packed nodes alone, one after another; the panels of 32 nodes that
 * hold none of them cost nothing. `nodes`: strictly ascending. Count 0: all nodes again. On the thread of the
 * visual frames, or while none is under way. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_session_request_nodes(pal_session* session, const uint32_t* nodes,
                                                   uint32_t count) PAL_NOEXCEPT;

/* Unit normals, out of the tissue, of the surface under displacements as pal_visual_frame writes them; zero
 * for nodes without a triangle (pal_geometry). Node i's three numbers are at (char*)normals + i *
 * normal_stride. Both strides in bytes, >= 3 sizeof(pal_real); the buffers must not overlap. Cost: one pass
 * over the triangles. Any thread. Real-time safe: yes. */
PAL_NODISCARD pal_status pal_pack_compute_normals(const pal_pack* pack, const pal_real* displacements,
                                                  size_t displacement_stride, pal_real* normals,
                                                  size_t normal_stride) PAL_NOEXCEPT;

/* Made in the caller, whose sizes these structs have. */
static inline pal_session_config pal_default_session_config(const pal_pack* pack) PAL_NOEXCEPT {
  pal_session_config config = PAL_ZERO;
  config.struct_size = (uint32_t)sizeof config;
  const pal_status filled = pal_session_fill_config(pack, &config);
  (void)filled;
  return config;
}

static inline pal_hold pal_default_hold(uint32_t site) PAL_NOEXCEPT {
  pal_hold hold = PAL_ZERO;
  hold.struct_size = (uint32_t)sizeof hold;
  hold.sites[0] = site;
  hold.weights[0] = 1;
  hold.unstrained.orientation[0] = 1;
  return hold;
}

static inline pal_contact pal_contact_at(const pal_surface_point* point,
                                         const double displacement[3]) PAL_NOEXCEPT {
  pal_contact contact = PAL_ZERO;
  contact.site = point->sites[0];
  for (int i = 0; i < 3; ++i) contact.displacement[i] = displacement[i];
  for (int i = 0; i < 2; ++i) {
    contact.neighbours[i] = point->sites[i + 1];
    contact.neighbour_weights[i] = point->weights[i + 1];
  }
  return contact;
}

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_PALPATE_H */
