// A set of contacts and its nonlinear zones.
//
// A zone V is the elements in rings about the patches of contacts, and their nodes. Its boundary B is the nodes that also
// belong to elements outside, and the nodes that are fixed while running. The refining lane condenses the organ outside
// onto B as a stiffness S (condensation.hpp).
//
// Contacts whose zones share a node share a zone, a *group*. Groups act on each other through the blocks of S between them.
// The lane prepares a set with S at rest (preparation.hpp) and hands over the tangent S later (refinement.hpp).
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/base/arena.hpp"
#include "runtime/src/numerics/elimination.hpp"
#include "runtime/src/numerics/pose.hpp"
#include "runtime/src/zone/zone_elements.hpp"

namespace palpate {

using pack::kMostZoneContacts;
using pack::kMostZoneFixed;

inline constexpr uint32_t kMostZoneAxes = 6 * kMostZoneContacts;

struct ZoneGroup {
  uint32_t num_contacts;
  uint32_t contacts[kMostZoneContacts];  // which of the set's
  uint32_t
      num_axes;  // of its contacts: three displacements each and, where patches turn, as many rotations behind them
  uint32_t first_node;  // in the set's list: interior, boundary, held, fixed
  uint32_t num_interior;
  uint32_t num_boundary;
  uint32_t num_held;
  uint32_t num_nodes;
  ZoneBatches batches;
  // Of the matrix of a tangent: unknowns of interior and boundary, then the axes of the contacts.
  uint32_t unknowns;
  uint32_t size;
  uint32_t stride;
  uint32_t boundary_stride;
  double* exterior;   // S of this boundary: [boundary_stride][boundary_stride], symmetric
  double* couplings;  // S of this boundary x the others', one behind the other: [boundary_stride] a column
  bool has_new_exterior;  // since the tangent was begun
  double* coupled;  // [boundary_stride] force of the other groups' boundaries on this one, when found last
  double others_moved;         // since then
  double* coupled_in_balance;  // [boundary_stride] `coupled`, when the group was in balance last
  double* exterior_force;      // [boundary_stride] S w_B, of evaluate_group()
  // The tangent (zone_tangent.hpp)
  double* factor;         // [size rounded to columns][stride], eliminated
  double* sensitivities;  // [num_axes][unknowns] d unknown / d axis, negative
  double* step;           // [unknowns] Newton's last
  bool has_tangent;
  bool is_shifted;  // the stiffness was made positive definite
  double moved;     // how far contacts and nodes have moved since it was begun
  double left;      // of the residual, by its last step that was one
  double* spare;    // the next one, as `factor`
  double* spare_sensitivities;
  size_t tangent_place;      // of either, in those of ZoneState
  bool is_assembling;        // it is not taken yet:
  uint32_t shift;            // attempts before
  uint32_t assembled;        // parts of it
  uint32_t column;           // eliminated before
  uint32_t substituted;      // sensitivities
  double moved_since;        // it was begun
  double energy;             // of the elements, at the displacements that were evaluated last
  double stored;             // of the group and the organ outside, as it was concluded last
  bool has_balance;          // ZoneSet::balanced is one; else where the group began
  double stored_in_balance;  // when it was in balance last
  uint32_t failures;         // solves in which there was no way on, since one that came to its end
  uint32_t astray;           // solves in a row of which the last step left most of the residual
  uint32_t late;             // solves in a row after which rest was nearer to the goal than contacts were
  uint32_t jammed;  // solves in a row in which no part of a step of its contacts left all elements upright
  bool is_back;     // it was taken back to its balance or to rest, in the last solve
  // Where its contacts were to be when it began anew at rest because they were jammed, and how far from there their way
  // from rest has to pass for it to do so again; 0: they have got to where they were to be since.
  double given_up[kMostZoneAxes];
  double elsewhere;
  double longest_step;  // of a contact from where the group was in balance last, in mean edges of the surface
  // How far unknowns, [unknowns], and axes went in the last solve, if it was the axes that moved the rest; where this one
  // began (zone_motion.hpp).
  bool has_trend;
  double* trend;
  double* began;
  double axes_trend[kMostZoneAxes];
  double axes_began[kMostZoneAxes];
};

inline uint32_t first_boundary(const ZoneGroup& group) {
  return group.first_node + group.num_interior;
}

// Numbers of the displacements that are solved for, from its first node on.
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

// Where a set has got to, and what its contacts and the organ outside bear there.
struct ZonePlace {
  double* displacement;                // [max_nodes][3] from the mesh
  double* followed;                    // by axis, of the contacts' patches, from rest
  double* force;                       // by axis, and torques
  double (*points)[3];                 // [max_contacts] at rest, length unit, about which patches turn
  double (*stiffness)[kMostZoneAxes];  // [num_axes] of the tangents; zero between groups
};

// What the refining lane has found of the exterior (zone_mailbox.hpp): with w the boundary's displacement, the force on the
// boundary is S w + c, and the energy w . S w / 2 + c . w + C. At rest c and C are zero.
struct ZoneCorrection {
  uint64_t number;        // no other set of the session has it
  uint32_t restarts;      // how often the correction was dropped
  bool is_refined;        // c and C are those of a delivery
  uint32_t failures;      // iterations in a row that were not good
  uint32_t field;         // its field among those of ZoneMailbox
  double* force;          // [max_nodes][3] c, by the places of the set's nodes
  double energy;          // C
  uint64_t tangent;       // number of S among the lane's
  uint64_t rest_tangent;  // and of ZoneSet::exterior_at_rest
  double change;          // ZoneDelivery::change; infinite where no iteration of this tissue has succeeded
  double* followed_then;  // ZoneSet::followed of the delivery's request
  // By how much the delivery changed the force of each contact, contacts at rest; negative: not known
  double force_change[kMostZoneContacts];
  double* load_then;  // [max_nodes][3] ZoneSet::load of the delivery's request; zero at rest
};

struct ZoneSet {
  bool ready;
  bool sound;  // else it cannot answer: it is more than the pack said, or the organ is not positive definite
  uint32_t num_contacts;
  uint32_t* sites;  // [max_contacts]
  uint32_t num_fixed;
  uint32_t* fixed;         // [max_fixed] contact nodes
  uint32_t fixed_version;  // of the session's
  uint32_t flags;          // PAL_FLAG_OVERLAPPING
  // Of ZoneState's, that its elements have; kNoInclusion: it was just made, and they are the pack's
  uint32_t inclusion_version;
  uint32_t num_groups;
  ZoneGroup* groups;  // [max_contacts]
  uint32_t num_nodes;
  uint32_t* nodes;  // [max_nodes] zone nodes, group by group
  uint32_t num_elements;
  uint32_t* elements;    // [max_elements] zone elements, group by group
  uint32_t* unknown_of;  // [max_nodes] ZoneUnknowns::of_node; within the group. kNoUnknown: it does not move
  uint32_t* first_master;  // [max_nodes + 1]
  ZoneMaster* masters;     // [max_masters]
  double* displacement;    // [max_nodes][3] from the mesh
  double* rest_force;      // [max_nodes][3] of the elements at rest, which the organ's weight holds
  double*
      load;  // [max_nodes][3] forces that hold nodes of patches and nodes fixed while running; zero elsewhere
  // By axis: displacements [num_contacts][3] and, where patches turn, turns [num_contacts][3] (patch_rotation.hpp)
  uint32_t num_axes;
  double* followed;  // of the contacts' patches, from rest
  double* wanted;    // where they were to be in the last frame: from there given forces go on
  double* force;     // and torques
  double (*stiffness)[kMostZoneAxes];  // [num_axes] of the tangents; zero between groups
  // [max_contacts] places at rest, length unit: patches turn about `points`, which follow `places`, the contacts'
  double (*points)[3];
  double (*places)[3];
  double (*turning)[9];  // [max_contacts] d torque / d rotation of the patch under the forces on its nodes
  ZoneCorrection correction;
  ZonePlace balanced;  // of each group, when it was in balance last, or where it began
  ZoneBatch<4>* linear;
  ZoneBatch<10>* quadratic;
  ZonePatch* patches;
  double* exterior_at_rest;  // [max_exterior] S of all groups (exterior_size())
  double* rows;  // [max_rows] sensitivities of tangents, those in use and the next; other vectors of groups
};

// Of an axis of a group's contacts: which of those of the set.
inline uint32_t contact_axis(const ZoneSet& set, const ZoneGroup& group, uint32_t i) {
  const uint32_t displacements = 3 * group.num_contacts;
  const uint32_t of_set = i < displacements ? 0 : 3 * set.num_contacts;
  const uint32_t own = i < displacements ? i : i - displacements;
  return of_set + 3 * group.contacts[own / 3] + own % 3;
}

// ZoneGroup::longest_step at most: no tool moves as fast, but some take hold under strain. One whose solves do not end
// while it moves is held up there until one does.
inline constexpr double kLongestStep = 0.5;

// In mean edges of the surface: who has moved no farther has not moved.
inline constexpr double kStill = 1e-9;

// det F of an element that is accepted. Full solves of neighbours that crush what is between them go to 1e-3; the
// rest is for what Newton passes on its way.
inline constexpr double kLeastJacobian = 1e-4;

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
  size_t tangents;  // numbers of the matrices of a tangent of each group
};

// Vectors of a lane that evaluates groups: of the group at hand (zone_balance.hpp), but for the first two.
struct ZoneWork {
  double* forces;  // [nodes][3] of the elements, beyond those at rest
  double* saved;   // [nodes][3]
  double* residual;
  double* boundary;
  double* outside;
  double* vector;
};

// The haptic lane's. The refining lane prepares the next set (preparation.hpp).
struct ZoneState {
  ZoneRoom room;
  EliminationKernel kernel;
  // Frames have a budget: they make one tangent of a group anew, and no more, as it is most of what they then take
  bool is_bounded;
  Inclusion inclusion;
  uint32_t inclusion_version;  // how often it has changed
  // Since tools were answered last: energy that inclusions have brought to the set that answers, model units; a group
  // of it found no way on, and is back where it was in balance last, or at rest
  double inclusion_energy;
  double
      corrected_energy;  // the energy that corrections have brought where tools stand, since somebody took it
  bool has_jumped;       // a correction began, or was dropped, since somebody took it
  bool went_back;
  bool strained;  // the set has been solved since it was at rest
  ZoneSet active;
  double* tangents[2];  // [ZoneRoom::tangents] each: those in use and the next ones
  double* exterior;     // [ZoneRoom::exterior] S of the last delivery (zone_mailbox.hpp)
  ZoneWork work;
};

// Axes along which the node at a place of a set can move: bits 0 to 2.
inline uint32_t moving_axes(const pal_pack& pack, const ZoneSet& set, uint32_t place) {
  return set.unknown_of[place] == kNoUnknown ? 0 : pack.zone_nodes[set.nodes[place]].free_axes;
}

// Contact nodes that are fixed while running.
struct FixedNodes {
  uint32_t count;
  const uint32_t* nodes;
  uint32_t version;  // how often they have changed
};

// Room for so many contacts and fixed nodes, at most kMostZoneContacts and kMostZoneFixed.
ZoneRoom zone_room(const pal_pack& pack, uint32_t max_contacts, uint32_t max_fixed, uint32_t rings,
                   bool turns);

void carve_set(const pal_pack& pack, const ZoneRoom& room, Arena& arena, ZoneSet& set);
void carve_work(const ZoneRoom& room, Arena& arena, ZoneWork& work);
void carve_zone(const pal_pack& pack, const ZoneRoom& room, Arena& arena, ZoneState& state);

// Whether a set is, or will be, for these contacts and fixed nodes.
bool is_zone_for(const ZoneSet& set, const pal_contact* contacts, uint32_t count, uint32_t fixed_version);

// ZoneSet::places, of the contacts of the set.
void find_places(const pal_pack& pack, const pal_contact* contacts, ZoneSet& set);

// Which of a set a contact is of; null where it has none.
const ZoneGroup* group_of(const ZoneSet& set, uint32_t contact);

// Whether no other contact shares a zone with this one.
bool is_alone_in_zone(const ZoneSet& set, uint32_t contact);

// Whether elements of the organ are outside of the set's zones.
bool has_exterior(const ZoneSet& set);

// Numbers of S of all groups: for each S of its own boundary, then those with the others' (ZoneGroup).
size_t exterior_size(const ZoneSet& set);

// All groups have S from there.
void use_exterior(double* exterior, ZoneSet& set);

// Forgets the correction, as where the contacts begin anew at rest.
void drop_correction(ZoneSet& set);

// How the patch of a contact has turned.
Rotation patch_rotation(const ZoneSet& set, uint32_t contact);

// From the point of a contact to a zone node at rest.
void rest_arm(const pal_pack& pack, const ZoneSet& set, uint32_t contact, uint32_t node, double out[3]);

// ZoneSet::balanced := where the group is, in balance.
void keep_balance(ZoneSet& set, ZoneGroup& group);

// Takes a group back there. It has no tangent then.
void go_back_to_balance(ZoneSet& set, ZoneGroup& group);

// Puts a group of a set at rest, wherever it was.
void rest_group(const pal_pack& pack, ZoneSet& set, ZoneGroup& group);

}  // namespace palpate
