// A set of contacts and its nonlinear zones.
//
// A zone V is the elements in rings about the patches of contacts, and their nodes. Its boundary B is the nodes that
// also belong to elements outside, and the nodes that are fixed while running. The refining lane condenses the organ
// outside onto B as a stiffness S (condensation.hpp).
//
// Contacts whose zones share a node share a zone, a *group*. How groups act on each other: zone_balance.hpp. The lane
// prepares a set with S at rest (preparation.hpp) and hands over the tangent S later (refinement.hpp).
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

// The exterior as the boundary of a group meets it (zone_balance.hpp).
struct GroupExterior {
  float* stiffness;  // [boundary_stride][boundary_stride] the block of S of this boundary, symmetric
  double* force;     // [boundary_stride] S w_B, computed by find_exterior_force()
  double* coupling;  // [axes of the set][boundary_stride] T
  double* coupled;   // [boundary_stride] T d, computed by find_coupling()
  double* coupled_in_balance;  // [boundary_stride] `coupled` at the last balance of the group
};

// The tangent in use (zone_tangent.hpp).
struct ZoneTangent {
  float* factor;          // [size rounded to columns][stride], eliminated
  double* sensitivities;  // [num_axes][unknowns] - d unknown / d axis
  double* step;           // [unknowns] the last Newton step
  bool is_shifted;        // the tangent was made positive definite by a shift
  double moved;           // length that contacts and nodes have moved since its state
  uint32_t age;           // solves since the zone has moved from its state
  double moved_since;     // as `moved`, since the state of the last request to the refining lane
  uint32_t age_since;     // solves since that request
  double left;            // part of the residual that the last Newton step left
};

// Solves with a fault, in a row (zone_setback.hpp).
struct ZoneSetbacks {
  uint32_t failures;  // setbacks since a solve converged
  uint32_t astray;    // the last step left most of the residual
  uint32_t late;      // the goal ended nearer to rest than to the contacts
  uint32_t jammed;    // every part of the contacts' step inverted an element
  bool is_back;       // the last solve took the group back to its balance or to rest
  // The goal at which a jammed group began again at rest. The group does so again only for goals whose straight way
  // from rest stays farther than `elsewhere`, a length, from given_up. `elsewhere` is 0 once contacts reach a goal.
  double given_up[kMostZoneAxes];
  double elsewhere;
  double longest_step;  // mean surface edges that a contact may go from the last balance
};

// Changes of the last frame (zone_motion.hpp).
struct ZoneTrend {
  bool is_good;                // the tangent explains most of Du
  double* unknowns;            // [unknowns] Du
  double* began;               // [unknowns] where the unknowns of this frame began
  double axes[kMostZoneAxes];  // Dd
  double axes_began[kMostZoneAxes];
};

// The unknowns of a group, and the rows of its tangent's matrix.
struct GroupLayout {
  uint32_t num_axes;  // three displacements a contact, then three rotations a contact where patches turn
  // Nodes of the group in ZoneSet::nodes: interior, boundary, held and fixed ones in turn
  uint32_t first_node;
  uint32_t num_interior;
  uint32_t num_boundary;
  uint32_t unknowns;  // displacements of interior and boundary nodes, rounded up to kEliminationColumns
  uint32_t size;      // rows: the unknowns, then num_axes
  uint32_t stride;
  uint32_t boundary_stride;
  size_t matrix_place;  // of the tangent in TangentBuffers
  size_t rows_place;
};

// Tangents of all groups of a set, one after the other.
struct TangentBuffers {
  float* matrices;  // [ZoneRoom::tangents]
  double* rows;     // [ZoneRoom::tangent_rows] sensitivities
};

// Contacts that share a zone, and the state of the solves of that zone.
struct ZoneGroup : GroupLayout {
  uint32_t num_contacts;
  uint32_t contacts[kMostZoneContacts];  // contacts of the set, by number
  uint32_t num_held;
  uint32_t num_nodes;
  ZoneBatches batches;
  GroupExterior exterior;
  bool has_tangent;
  ZoneTangent tangent;
  ZoneTrend trend;
  ZoneSetbacks setbacks;
  double energy;             // of the elements, at the last evaluated displacements
  double smallest_jacobian;  // det F there
  double steepest;           // steepest_gradient()
  double stored;             // energy of the group and of the organ outside, at the end of the last solve
  bool has_balance;  // ZoneSet::balanced has a balance of the group; else the state where the group began
  double stored_in_balance;  // `stored` at the last balance
};

inline uint32_t first_boundary(const ZoneGroup& group) {
  return group.first_node + group.num_interior;
}

// Displacements of interior and boundary nodes, from the first node of the group on.
inline uint32_t num_moving(const ZoneGroup& group) {
  return 3 * (group.num_interior + group.num_boundary);
}

// pal_inclusion in model units (zone_inclusion.hpp).
struct Inclusion {
  bool is_present;
  double centre[3];
  double radius;
  double stiffness;
};

inline constexpr uint32_t kNoInclusion = UINT32_MAX;  // ZoneSet::inclusion_version

// A state of a set: displacements, and the forces on the contacts.
struct ZonePlace {
  double* displacement;                // [max_nodes][3] from the mesh
  double* followed;                    // [num_axes] displacements and turns of the patches, from rest
  double* force;                       // [num_axes] forces and torques
  double (*points)[3];                 // [max_contacts] points at rest about which patches turn, length unit
  double (*stiffness)[kMostZoneAxes];  // [num_axes] of the tangents; zero between groups
};

// The exterior as the refining lane has delivered it (zone_mailbox.hpp): c and C of zone_balance.hpp, zero at rest.
struct ZoneCorrection {
  uint64_t number;    // no other set of the session has this number
  uint32_t restarts;  // times that the correction was dropped
  bool is_refined;    // c, C and the field's displacements come from a delivery; else they are those at rest
  uint32_t failures;  // deliveries in a row whose exterior iteration was not good (refinement.cpp)
  uint32_t field;     // index of the delivered field in ZoneMailbox
  uint32_t rest_field;    // index of the field that the set was prepared with, which has its response at rest
  double* force;          // [max_nodes][3] c, in the order of ZoneSet::nodes
  double energy;          // C
  uint64_t tangent;       // number of S among the lane's tangents
  uint64_t rest_tangent;  // number of ZoneSet::exterior_at_rest among them
  double change;          // ZoneDelivery::change; infinite where no iteration of this tissue has succeeded
  bool is_unstable;       // ZoneDelivery::is_unstable
  double* followed_then;  // ZoneSet::followed where the field's displacements belong to; zero at rest
  double* coupled_then;   // [num_axes] sum over groups of T^T w_e
  // The change that the delivery made to the force of each contact, where all contacts stand still; negative: unknown
  double force_change[kMostZoneContacts];
};

// What a frame has named (state_transfer.hpp).
struct NamedContacts {
  uint32_t num_contacts;
  uint32_t num_axes;    // displacements [num_contacts][3], then turns [num_contacts][3] where patches turn
  uint32_t* sites;      // [max_contacts]
  double (*places)[3];  // [max_contacts] the contacts' places at rest
  uint32_t num_fixed;
  uint32_t* fixed;         // [max_fixed] contact nodes
  uint32_t fixed_version;  // FixedNodes::version for which the set was made
};

// Nodes and elements of the zones, group by group (zone_members.hpp).
struct ZoneMembers {
  uint32_t num_nodes;
  uint32_t* nodes;       // [max_nodes] nodes of the organ
  uint32_t* unknown_of;  // [max_nodes] first of three in the group; kHeldUnknown: masters move it; kNoUnknown
  uint32_t* first_master;  // [max_nodes + 1]
  uint32_t num_masters;
  ZoneMaster* masters;  // [max_masters]
  double* rest_force;   // [max_nodes][3] of the elements at rest, which the organ's weight holds
  ZoneBatch<4>* linear;
  ZoneBatch<10>* quadratic;
  ZonePatch* patches;
};

struct ZoneSet : NamedContacts, ZoneMembers {
  bool ready;
  bool sound;  // the set fits the pack's capacities and the organ is positive definite; else it cannot answer
  uint32_t flags;  // PAL_FLAG_OVERLAPPING
  // ZoneState::inclusion_version that the elements have; kNoInclusion: the set is new and has the pack's elements
  uint32_t inclusion_version;
  uint32_t num_groups;
  ZoneGroup* groups;      // [max_contacts]
  double* displacement;   // [max_nodes][3] from the mesh
  double* followed;       // [num_axes] of the patches, from rest
  double* wanted;         // [num_axes] goal of the last frame along axes of given forces; else as `followed`
  double* force;          // [num_axes] forces and torques
  double* coupled_force;  // [num_axes] the part p of `force`
  double (*coupled_stiffness)[kMostZoneAxes];  // [num_axes] M
  double (*stiffness)[kMostZoneAxes];          // [num_axes] of the tangents; zero between groups
  double (*points)[3];   // [max_contacts] points at rest, length unit, about which patches turn
  double (*turning)[9];  // [max_contacts] d torque / d rotation of the patch under the forces on its nodes
  ZoneCorrection correction;
  ZonePlace balanced;       // the last balance of each group, or the state in which the group began
  float* exterior_at_rest;  // [max_exterior] S of all groups (exterior_size())
  double* rows;             // [max_rows] vectors of groups
};

// The axis of the set that is axis `i` of a group.
inline uint32_t contact_axis(const ZoneSet& set, const ZoneGroup& group, uint32_t i) {
  const uint32_t displacements = 3 * group.num_contacts;
  const uint32_t of_set = i < displacements ? 0 : 3 * set.num_contacts;
  const uint32_t own = i < displacements ? i : i - displacements;
  return of_set + 3 * group.contacts[own / 3] + own % 3;
}

// The longest ZoneGroup::setbacks.longest_step. Hands move less in a frame; a tool that takes hold of strained tissue may
// start so far away. A group that falls behind waits there until it is in balance.
inline constexpr double kLongestStep = 0.5;

// A shorter move, in mean surface edges, is none.
inline constexpr double kStill = 1e-9;

// Capacities of a set.
struct ZoneRoom {
  uint32_t contacts;
  uint32_t axes_per_contact;  // 6: patches turn with their contacts; else 3
  uint32_t fixed;
  uint32_t rings;
  uint32_t nodes;
  uint32_t boundary;
  uint32_t elements;
  uint32_t quadratic;  // elements of ten nodes
  uint32_t masters;
  size_t exterior;  // numbers of S of all groups
  size_t rows;
  size_t tangents;      // numbers of TangentBuffers::matrices
  size_t tangent_rows;  // and of TangentBuffers::rows
};

// Vectors of a lane that evaluates groups. The first two cover the set, the others one group (zone_balance.hpp).
struct ZoneWork {
  double* forces;  // [nodes][3] of the elements, beyond those at rest
  double* saved;   // [nodes][3]
  double* residual;
  double* boundary;
  double* outside;
  double* vector;
};

// The zones of the haptic lane. The refining lane prepares the next set (preparation.hpp).
struct ZoneState {
  ZoneRoom room;
  EliminationKernel kernel;
  bool is_bounded;  // a frame makes at most one tangent a group
  Inclusion inclusion;
  uint32_t inclusion_version;  // changes of the inclusion
  bool strained;               // the set has been solved since it was at rest
  // What happened since tools last took these values (tools.cpp), in model units:
  double inclusion_energy;  // energy that inclusions have brought to the active set
  double corrected_energy;  // energy that deliveries have brought at the tools' places
  bool has_jumped;          // a correction began or was dropped
  bool went_back;           // a group found no way on, and is back at its last balance or at rest
  ZoneSet active;
  TangentBuffers tangents;
  float* exterior;  // [ZoneRoom::exterior] S of the last delivery (zone_mailbox.hpp)
  ZoneWork work;
};

// The node at a place of a set.
inline const pack::OrganNode& node_at(const pal_pack& pack, const ZoneMembers& set, uint32_t place) {
  return pack.organ.nodes[set.nodes[place]];
}

// Axes along which the node at a place of a set can move: bits 0 to 2.
inline uint32_t moving_axes(const pal_pack& pack, const ZoneMembers& set, uint32_t place) {
  return set.unknown_of[place] == kNoUnknown ? 0 : node_at(pack, set, place).free_axes;
}

// Contact nodes that are fixed while running.
struct FixedNodes {
  uint32_t count;
  const uint32_t* nodes;
  uint32_t version;  // changes so far
};

// Room for so many contacts and fixed nodes, at most kMostZoneContacts and kMostZoneFixed.
ZoneRoom zone_room(const pal_pack& pack, uint32_t max_contacts, uint32_t max_fixed, uint32_t rings,
                   bool turns);

void carve_set(const pal_pack& pack, const ZoneRoom& room, Arena& arena, ZoneSet& set);
TangentBuffers carve_tangents(const ZoneRoom& room, Arena& arena);
void carve_work(const ZoneRoom& room, Arena& arena, ZoneWork& work);
void carve_zone(const pal_pack& pack, const ZoneRoom& room, Arena& arena, ZoneState& state);

// Whether a set was made for these contacts and fixed nodes.
bool is_zone_for(const ZoneSet& set, const pal_contact* contacts, uint32_t count, uint32_t fixed_version);

// Sets ZoneSet::places.
void find_places(const pal_pack& pack, const pal_contact* contacts, ZoneSet& set);

// The group that a contact belongs to, or null.
const ZoneGroup* group_of(const ZoneSet& set, uint32_t contact);

// Whether no other contact shares a zone with this one.
bool is_alone_in_zone(const ZoneSet& set, uint32_t contact);

// Whether elements of the organ are outside of the set's zones.
bool has_exterior(const ZoneSet& set);

// Numbers in S of all groups: ZoneGroup::exterior.stiffness, group by group.
size_t exterior_size(const ZoneSet& set);

// Points each group at its block of this S.
void use_exterior(float* exterior, ZoneSet& set);

// Takes c, C and S back to rest; contacts stay.
void drop_correction(ZoneSet& set);

// The change of the axes of a set between two vectors: differences of displacements, and rotation vectors from one
// patch rotation to the other.
void find_axes_change(uint32_t num_contacts, uint32_t num_axes, const double* from, const double* to,
                      double* change);

// How the patch of a contact has turned.
Rotation patch_rotation(const ZoneSet& set, uint32_t contact);

// The vector from the point of a contact to a node of the organ, at rest.
void rest_arm(const pal_pack& pack, const ZoneSet& set, uint32_t contact, uint32_t node, double out[3]);

// Stores the state of a group that is in balance in ZoneSet::balanced.
void keep_balance(ZoneSet& set, ZoneGroup& group);

// Takes a group back to ZoneSet::balanced and drops its tangent.
void go_back_to_balance(ZoneSet& set, ZoneGroup& group);

// Puts a group of a set at rest.
void rest_group(const pal_pack& pack, ZoneSet& set, ZoneGroup& group);

}  // namespace palpate
