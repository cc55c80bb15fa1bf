// A set of contacts and its nonlinear zones.
//
// A zone V is the elements in rings about the patches of contacts, with their nodes. Its boundary B is the
// nodes that elements outside share, and the nodes fixed while running. The refining lane (refinement.hpp)
// condenses the organ outside onto B as a stiffness S: at rest for a new set, later with other tangents.
//
// - group: contacts whose zones share a node (zone_balance.hpp)
// - place: index of a node in ZoneSet::nodes
// - axis: displacement or rotation component of a contact
// - balance: the last equilibrium to which a group has converged
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/base/arena.hpp"
#include "runtime/src/elements/zone_elements.hpp"
#include "runtime/src/numerics/elimination.hpp"
#include "runtime/src/numerics/pose.hpp"

namespace palpate {

using pack::kMostZoneContacts;
using pack::kMostZoneFixed;

inline constexpr uint32_t kMostZoneAxes = 6 * kMostZoneContacts;

// The forces and stiffness of the exterior on the boundary of a group (zone_balance.hpp).
struct GroupExterior {
  float* stiffness;            // [boundary_stride][boundary_stride] S_gg, both triangles
  double* force;               // [boundary_stride] S w_B, computed by find_exterior_force()
  double* coupling;            // [axes of the set][boundary_stride] T
  double* coupled;             // [boundary_stride] T d, computed by find_coupling()
  double* coupled_in_balance;  // [boundary_stride] `coupled` in the balance of the group
};

// The tangent in use (zone_tangent.hpp).
struct ZoneTangent {
  float* factor;          // [size rounded to columns][stride], eliminated
  double* sensitivities;  // [num_axes][unknowns] - d unknown / d axis
  double* step;           // [unknowns] the last Newton step
  bool is_shifted;        // a raised diagonal made the tangent positive definite
  double moved;           // path length of contacts and nodes since the tangent's state
  uint32_t age;           // solves since the zone left the tangent's state
  double moved_since;     // path length since the last request to the refining lane
  uint32_t age_since;     // solves since that request
  double residual_ratio;  // |r| after / before the last measured Newton step; 0: new tangent
};

// Counts of faulty solves. A setback returns a group to its balance or to rest (zone_setback.hpp).
struct ZoneSetbacks {
  uint32_t failures;     // setbacks since a solve converged
  uint32_t stalled;      // unconverged solves in a row whose last step left most of the residual
  uint32_t nearer_rest;  // solves in a row after which the goal was nearer to rest than to the contacts
  uint32_t jammed;       // solves in a row in which every part of the contacts' step inverted an element
  bool is_back;          // the group was returned to its balance or to rest since the last solve began
  // [axes of the group] goal of the contacts at the last restart of a jammed group. The next restart requires
  // a straight path from rest to the goal that keeps `retry_distance`, a length, from jammed_goal.
  double jammed_goal[kMostZoneAxes];
  double retry_distance;
  double longest_step;  // largest distance of a step's goal from the balance, mean surface edges
};

// Changes by the last frame, from which the next frame predicts its unknowns (zone_motion.hpp).
struct ZoneTrend {
  bool is_good;                      // the tangent explains most of Du
  double* unknowns;                  // [unknowns] Du
  double* began;                     // [unknowns] u at the begin of this frame
  double axes[kMostZoneAxes];        // Dd
  double axes_began[kMostZoneAxes];  // d at the begin of this frame
};

// The unknowns of a group, and the rows of its tangent's matrix.
struct GroupLayout {
  uint32_t num_axes;    // three displacements for each contact, then three rotations if patches turn
  uint32_t first_node;  // place of the first interior node; boundary, held and fixed nodes follow
  uint32_t num_interior;
  uint32_t num_boundary;
  uint32_t unknowns;  // displacements of interior and boundary nodes, rounded up to kEliminationColumns
  uint32_t size;      // rows: the unknowns, then num_axes
  uint32_t stride;
  uint32_t boundary_stride;
  size_t matrix_place;  // first number of the tangent in TangentBuffers::matrices
  size_t rows_place;    // first number of the sensitivities in TangentBuffers::rows
};

// Tangents of all groups of a set, one after the other.
struct TangentBuffers {
  float* matrices;  // [ZoneRoom::tangents]
  double* rows;     // [ZoneRoom::tangent_rows] sensitivities
};

// Contacts that share a zone, and the state of the solves of that zone.
struct ZoneGroup : GroupLayout {
  uint32_t num_contacts;
  uint32_t contacts[kMostZoneContacts];  // [num_contacts] numbers of contacts of the set
  uint32_t num_held;                     // nodes of the patches
  uint32_t num_nodes;
  ZoneBatches batches;
  GroupExterior exterior;
  bool has_tangent;
  ZoneTangent tangent;
  ZoneTrend trend;
  ZoneSetbacks setbacks;
  double energy;             // energy of the elements at the last evaluated displacements
  double smallest_jacobian;  // smallest det F at these displacements
  double steepest;           // steepest_gradient(), 1 / length
  double stored;             // energy of the group and of the organ outside at the end of the last solve
  bool has_balance;          // ZoneSet::balanced has the balance; else the group's first state
  double stored_in_balance;  // `stored` in the balance
};

inline uint32_t first_boundary(const ZoneGroup& group) {
  return group.first_node + group.num_interior;
}

// Returns the number of displacement components of interior and boundary nodes.
inline uint32_t num_moving(const ZoneGroup& group) {
  return 3 * (group.num_interior + group.num_boundary);
}

// pal_inclusion in model units; `stiffness` is a factor (zone_inclusion.hpp).
struct Inclusion {
  bool is_present;
  double centre[3];
  double radius;
  double stiffness;
};

inline constexpr uint32_t kNoInclusion = UINT32_MAX;  // ZoneSet::inclusion_version

// Arrays of a set that describe its state.
struct SetState {
  double* displacement;                // [max_nodes][3] from the mesh
  double* followed;                    // [num_axes] displacements and rotations of the patches from rest
  double* force;                       // [num_axes] forces and torques
  double (*points)[3];                 // [max_contacts] as ZoneSet::points
  double (*stiffness)[kMostZoneAxes];  // [num_axes] as ZoneSet::stiffness
};

// The last delivery of the refining lane (zone_mailbox.hpp). c and C of zone_balance.hpp are zero at rest.
struct ZoneCorrection {
  uint64_t number;        // number of the set, unique in the session
  uint32_t restarts;      // times that drop_correction() was called
  bool is_refined;        // c, C and the field's displacements come from a delivery, not from rest
  uint32_t failures;      // deliveries in a row with a failed exterior iteration (refinement.cpp)
  uint32_t field;         // index of the delivered field in ZoneMailbox::fields
  uint32_t rest_field;    // index of the field of the set's preparation
  double* force;          // [max_nodes][3] c, in the order of ZoneSet::nodes
  double energy;          // C
  uint64_t tangent;       // number of S among the lane's tangents
  uint64_t rest_tangent;  // number of ZoneSet::exterior_at_rest among them
  double change;          // ZoneDelivery::change; infinite without a valid iteration of this tissue
  bool is_unstable;       // ZoneDelivery::is_unstable
  double* followed_then;  // [num_axes] d_e, ZoneSet::followed at the delivery's state
  double* coupled_then;   // [num_axes] sum over groups of T^T w_e
  // Size of each contact's force change by the delivery if all contacts stood still; negative: unknown
  double force_change[kMostZoneContacts];
};

// The contacts and fixed nodes for which a frame requests a set (state_transfer.hpp).
struct NamedContacts {
  uint32_t num_contacts;
  uint32_t num_axes;    // displacements [num_contacts][3], then rotations [num_contacts][3] if patches turn
  uint32_t* sites;      // [max_contacts] the nearest contact sites
  double (*places)[3];  // [max_contacts] points of the contacts at rest, length unit
  uint32_t num_fixed;
  uint32_t* fixed;         // [max_fixed] nodes fixed while running
  uint32_t fixed_version;  // FixedNodes::version of the set
};

// Nodes and elements of the zones, group by group (zone_members.hpp).
struct ZoneMembers {
  uint32_t num_nodes;
  uint32_t* nodes;  // [max_nodes] nodes of the organ
  // [max_nodes] first of the node's three unknowns in the group, or kHeldUnknown, kNoUnknown
  uint32_t* unknown_of;
  uint32_t* first_master;  // [max_nodes + 1] first entry of a held node in `masters`
  uint32_t num_masters;
  ZoneMaster* masters;  // [max_masters] contacts that move held nodes
  double* rest_force;   // [max_nodes][3] forces of the elements at rest, which the organ's weight balances
  ZoneBatch<4>* linear;
  ZoneBatch<10>* quadratic;
  ZonePatch* patches;
};

struct ZoneSet : NamedContacts, ZoneMembers {
  bool ready;                  // the preparation has ended
  bool sound;                  // the preparation has not failed; else the set cannot answer
  uint32_t flags;              // PAL_FLAG_OVERLAPPING
  uint32_t inclusion_version;  // ZoneState::inclusion_version of the elements; kNoInclusion: none
  uint32_t num_groups;
  ZoneGroup* groups;      // [max_contacts]
  double* displacement;   // [max_nodes][3] from the mesh
  double* followed;       // [num_axes] displacements and rotations of the patches from rest
  double* wanted;         // [num_axes] goal of the last frame along axes of given forces; else as `followed`
  double* force;          // [num_axes] forces and torques
  double* coupled_force;  // [num_axes] the part p of `force`
  double (*coupled_stiffness)[kMostZoneAxes];  // [num_axes] M
  double (*stiffness)[kMostZoneAxes];          // [num_axes] K_cc - X X^T of the tangents; zero between groups
  double (*points)[3];   // [max_contacts] points at rest about which patches turn, length unit
  double (*turning)[9];  // [max_contacts] d torque / d rotation of the patch under the forces on its nodes
  ZoneCorrection correction;
  SetState balanced;        // the balance of each group, or the group's first state
  float* exterior_at_rest;  // [max_exterior] S of all groups (exterior_size())
  double* rows;             // [max_rows] vectors of groups
};

// Returns the axis of the set that is axis `i` of a group.
inline uint32_t contact_axis(const ZoneSet& set, const ZoneGroup& group, uint32_t i) {
  const uint32_t displacements = 3 * group.num_contacts;
  const uint32_t first = i < displacements ? 0 : 3 * set.num_contacts;
  const uint32_t component = i < displacements ? i : i - displacements;
  return first + 3 * group.contacts[component / 3] + component % 3;
}

// Upper limit of ZoneSetbacks::longest_step, mean surface edges. A hand moves less in a frame, but a tool
// that begins to hold strained tissue may start farther away.
inline constexpr double kLongestStep = 0.5;

// A contact that moves less stands still, mean surface edges.
inline constexpr double kStill = 1e-9;

// Capacities of a set.
struct ZoneRoom {
  uint32_t contacts;
  uint32_t axes_per_contact;  // 6 if patches turn with their contacts, else 3
  uint32_t fixed;
  uint32_t rings;
  uint32_t nodes;
  uint32_t boundary;
  uint32_t elements;
  uint32_t quadratic;  // elements of ten nodes
  uint32_t masters;
  size_t exterior;      // floats of S of all groups
  size_t rows;          // numbers of ZoneSet::rows
  size_t tangents;      // floats of TangentBuffers::matrices
  size_t tangent_rows;  // numbers of TangentBuffers::rows
};

// Scratch vectors of a lane. The first two cover the set, the others one group (zone_balance.hpp).
struct ZoneWork {
  double* forces;    // [nodes][3] P(w) - P(0) of the elements
  double* saved;     // [nodes][3] displacements before a step (save_group())
  double* residual;  // [unknowns + num_axes] r (find_residual())
  double* boundary;  // [boundary_stride] w_B
  double* outside;   // [boundary_stride] q (find_outside())
  double* vector;    // scratch
};

// The zones of the haptic lane. The refining lane prepares the next set (preparation.hpp).
struct ZoneState {
  ZoneRoom room;
  EliminationKernel kernel;
  bool is_bounded;  // a solve makes at most one tangent for each group
  Inclusion inclusion;
  uint32_t inclusion_version;  // number of changes of the inclusion
  bool strained;               // the active set has been solved since it was at rest
  // Since the tools last read these values (runtime/src/tools), in model units:
  double inclusion_energy;  // energy that changes of the inclusion added to the active set
  double corrected_energy;  // energy that changes of the correction added
  bool has_jumped;          // a correction began or was dropped
  bool went_back;           // a group was returned to its balance or to rest
  ZoneSet active;
  TangentBuffers tangents;
  float* exterior;  // [ZoneRoom::exterior] S of the last delivery (zone_mailbox.hpp)
  ZoneWork work;
};

// Returns the organ's node at a place of a set.
inline const pack::OrganNode& node_at(const pal_pack& pack, const ZoneMembers& set, uint32_t place) {
  return pack.organ.nodes[set.nodes[place]];
}

// Returns the axes along which the node at a place of a set can move, as bits 0 to 2.
inline uint32_t moving_axes(const pal_pack& pack, const ZoneMembers& set, uint32_t place) {
  return set.unknown_of[place] == kNoUnknown ? 0 : node_at(pack, set, place).free_axes;
}

// Contact nodes that are fixed while running.
struct FixedNodes {
  uint32_t count;
  const uint32_t* nodes;
  uint32_t version;  // number of changes so far
};

// Returns the capacities of a set, for at most kMostZoneContacts contacts and kMostZoneFixed fixed nodes.
ZoneRoom zone_room(const pal_pack& pack, uint32_t max_contacts, uint32_t max_fixed, uint32_t rings,
                   bool turns);

void carve_set(const pal_pack& pack, const ZoneRoom& room, Arena& arena, ZoneSet& set);
TangentBuffers carve_tangents(const ZoneRoom& room, Arena& arena);
void carve_work(const ZoneRoom& room, Arena& arena, ZoneWork& work);
void carve_zone(const pal_pack& pack, const ZoneRoom& room, Arena& arena, ZoneState& state);

// Whether a set was prepared for these contacts and fixed nodes.
bool is_zone_for(const ZoneSet& set, const pal_contact* contacts, uint32_t count, uint32_t fixed_version);

// Computes ZoneSet::places.
void find_places(const pal_pack& pack, const pal_contact* contacts, ZoneSet& set);

// Returns the group of a contact, or null.
const ZoneGroup* group_of(const ZoneSet& set, uint32_t contact);

// Whether the contact is the only contact of its group.
bool is_alone_in_zone(const ZoneSet& set, uint32_t contact);

// Whether the zones of the set have boundary nodes.
bool has_exterior(const ZoneSet& set);

// Returns the floats of S of all groups: GroupExterior::stiffness, group by group.
size_t exterior_size(const ZoneSet& set);

// Makes each group use its block of S in `exterior`, [exterior_size()].
void use_exterior(float* exterior, ZoneSet& set);

// Resets c, C and S to their values at rest. Contacts and nodes stay.
void drop_correction(ZoneSet& set);

// Computes the change of the axes of a set between two states: differences of displacements, and for each
// patch the rotation vector from one rotation to the other.
void find_axes_change(uint32_t num_contacts, uint32_t num_axes, const double* from, const double* to,
                      double* change);

// Returns the rotation of the patch of a contact from rest.
Rotation patch_rotation(const ZoneSet& set, uint32_t contact);

// Computes the vector at rest from ZoneSet::points of a contact to a node of the organ.
void rest_arm(const pal_pack& pack, const ZoneSet& set, uint32_t contact, uint32_t node, double out[3]);

// Copies the state of a group in equilibrium to ZoneSet::balanced.
void keep_balance(ZoneSet& set, ZoneGroup& group);

// Returns a group to ZoneSet::balanced and drops its tangent.
void go_back_to_balance(ZoneSet& set, ZoneGroup& group);

// Puts a group at rest, and drops its tangent and the correction of the set.
void rest_group(const pal_pack& pack, ZoneSet& set, ZoneGroup& group);

}  // namespace palpate
