// What a nonlinear zone is made of, for a set of contacts.
//
// A zone V is the elements in rings about the patches of contacts, and their nodes. Outside of it the organ is taken
// to be linear, at first about rest, so all that the zone sees of it is a stiffness on the nodes B that also belong to elements
// outside. With C the compliance of the whole linear organ, K_V the stiffness of the zone's own elements at rest, I
// the nodes of V that are not in B:
//
//   T = C_BB^-1                                   the whole organ, condensed onto B
//   S_int = K_BB - K_BI K_II^-1 K_IB              the zone's own part of that (elimination.hpp)
//   S = T - S_int                                 the rest of the organ, to first order
//
// which is where C_VV^-1 - K_V differs from zero. In float64: what is left of two stiffnesses that nearly cancel.
//
// Nodes that are fixed while running belong to B, wherever they are, and do not move: t there is what fixes them, and
// T that of an organ that they hold. Eq. (20) of Zhong et al. 2005, for the organ outside.
//
// S is exact to first order; the refining lane corrects it, and hands over another S, the tangent where the organ has got
// to (refinement.hpp). Contacts whose zones share a node share a zone, a *group*. Groups act on each other through the
// blocks of that S between them; before the first delivery, through C (zone_balance.hpp).
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
  double*
      exterior;  // S: [boundary_stride][boundary_stride], symmetric; that at rest, or of the last delivery
  // S of this boundary x those of the other groups, one behind the other: [boundary_stride] a column; null: that at rest,
  // which is known by C between the boundaries, as `compliances`
  double* couplings;
  double* compliances;
  double* exterior_at_rest;
  double* own;            // S_int, as `exterior`
  bool has_new_exterior;  // since the tangent was begun
  double* coupled;  // [boundary_stride] force of the other groups' boundaries on this one, when found last
  double* moved_by_others;  // [boundary_stride] b (zone_balance.hpp), when found last
  double coupled_change;    // of b, when it was found last; 0 with S of a delivery
  double others_moved;      // since then
  double* exterior_force;   // [boundary_stride] S w_B, of evaluate_group()
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
// boundary is S w + c, and the energy w . S w / 2 + c . w + C. At rest, and before the first delivery, c and C are zero.
struct ZoneCorrection {
  uint64_t number;        // no other set of the session has it
  uint32_t restarts;      // how often the correction was dropped
  bool is_refined;        // a delivery was taken
  uint32_t failures;      // iterations in a row that were not good
  uint32_t field;         // its field among those of ZoneMailbox
  double* force;          // [max_nodes][3] c, by the places of the set's nodes
  double energy;          // C
  uint64_t tangent;       // number of S among the lane's; 0: that at rest
  double change;          // ZoneDelivery::change; infinite where no iteration of this tissue has succeeded
  double* followed_then;  // ZoneSet::followed of the delivery's request
  // By how much the delivery changed the force of each contact, contacts at rest; negative: not known
  double force_change[kMostZoneContacts];
  double* displacement_then;  // [max_nodes][3] displacements of the boundary at the delivery's iteration
};

struct ZoneSet {
  bool ready;
  bool sound;  // else it cannot answer: more than the pack said, or C_BB or K_II not positive definite
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
  // [max_nodes][3] t of boundary nodes: forces on the linear organ that move B as it has moved since the last delivery
  double* traction;
  // By axis: displacements [num_contacts][3] and, where patches turn, turns [num_contacts][3] (patch_rotation.hpp)
  uint32_t num_axes;
  double* followed;  // of the contacts' patches, from rest
  double* wanted;    // where they were to be in the last frame: from there given forces go on
  double* force;     // and torques
  double (*stiffness)[kMostZoneAxes];  // [num_axes] of the tangents; zero between groups
  double (*others)[kMostZoneAxes];     // [3 num_contacts] O (force_control.hpp)
  // [max_contacts] places at rest, length unit: patches turn about `points`, which follow `places`, the contacts'
  double (*points)[3];
  double (*places)[3];
  double (*turning)[9];  // [max_contacts] d torque / d rotation of the patch under the forces on its nodes
  ZoneCorrection correction;
  ZonePlace balanced;  // of each group, when it was in balance last, or where it began
  ZoneBatch<4>* linear;
  ZoneBatch<10>* quadratic;
  ZonePatch* patches;
  double* matrices;  // [max_matrices] S at rest, S_int and C between groups
  double* rows;      // [max_rows] their sensitivities, those in use and the next, steps and trends
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

// One set answers while another is made ready, if need be over several frames.
struct ZoneState {
  // Capacities
  uint32_t max_contacts;
  uint32_t axes_per_contact;  // 6: patches turn with their contacts; else 3
  uint32_t max_fixed;
  uint32_t rings;
  uint32_t max_nodes;
  uint32_t max_boundary;
  uint32_t max_elements;
  uint32_t max_quadratic;
  uint32_t max_masters;
  size_t max_matrices;
  size_t max_exterior;  // numbers of S of all groups
  size_t max_rows;
  size_t max_tangents;     // numbers of the matrices of a tangent of each group
  size_t max_preparation;  // of the matrices of making ready
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
  ZoneSet active;
  ZoneSet next;
  // Making the next one ready
  enum class Phase : uint32_t {
    collect,
    compliance,
    inverse,
    whole,
    stiffness,
    own,
    condensed,
    couple,
    place,
    tangent,
    done
  } phase;
  uint32_t group;
  uint32_t column;  // or step of the phase
  uint32_t masters_used;
  uint32_t linear_used;
  uint32_t quadratic_used;
  uint32_t patches_used;
  uint32_t boundary_used;
  // [num_zone_nodes] and [num_zone_elements]: a bit for each contact whose zone holds it
  uint64_t* node_contacts;
  uint64_t* element_contacts;
  uint32_t* found_nodes;     // [max_nodes]
  uint32_t* found_elements;  // [max_elements]
  uint32_t num_found_nodes;
  uint32_t num_found_elements;
  uint32_t* queue;     // [max_nodes]
  uint32_t* place_of;  // [num_zone_nodes] place in a set's list + 1; 0: not in it
  uint32_t* base;      // [max_nodes] unknowns of the stiffness at rest
  double* preparation;
  bool is_before_strained;   // the set that answers was, as placing began, and its tractions then
  double* tractions_before;  // [max_nodes][3]
  size_t matrices_used;
  size_t rows_used;
  size_t tangents_used;
  // A frame
  bool strained;  // the set that answers has been solved since it was at rest
  // [max_tangents] each: two of the set that answers, that in use and the next, and the first one of the next set
  double* tangents[3];
  double* exterior;  // [max_exterior] S of the set that answers, of the last delivery (zone_mailbox.hpp)
  double* forces;    // [max_nodes][3] of the elements, beyond those at rest
  double* saved;     // [max_nodes][3]
  // Of the group at hand (zone_balance.hpp); `boundary`, `vector` and `residual` within a step of making a set ready, too
  double* residual;
  double* boundary;
  double* outside;
  double* vector;
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

// Takes the arrays of a state for so many contacts and fixed nodes, at most kMostZoneContacts and kMostZoneFixed.
void carve_zone(const pal_pack& pack, uint32_t max_contacts, uint32_t max_fixed, uint32_t rings, bool turns,
                Arena& arena, ZoneState& state);

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

// C_ij, 3 x 3 by rows, of zone nodes free along some axis.
void zone_compliance(const pal_pack& pack, uint32_t i, uint32_t j, double block[9]);

// Multiply-adds that take as long: it comes from far away.
inline constexpr uint64_t kOfBlock = 1300;

}  // namespace palpate
