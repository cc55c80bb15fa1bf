// linear_dd of contacts anywhere on the surface: the blend of its answers at the sites about them.
//
// A contact c at a point has the weights w_ci of the sites i at the corners of its triangle (contact_place.hpp). With
// S_ij.. the stiffness of contacts at sites i, j, .. (linear_dd.hpp), all of them moved by the same displacements d,
//
//   F = S d,  S = sum over i, j, .. of w_1i w_2j .. S_ij..        and energy, field, gravity's share likewise,
//
// one term for each way to choose a corner for each contact: continuous as any of the contacts slides, the gradient
// of an energy, and the answer at the sites where contacts are at them. That is 3, 9 or 27 sets of sites; where there
// are more contacts than kMostBetween, they act at the sites of their largest weights, which is one set.
//
// A set is kept until another takes its place: a contact that slides into the next triangle needs only those sets
// that have the new corner. Each set is made of the one before, of which most have all nodes but those of one
// contact.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/linear/linear_dd.hpp"
#include "runtime/src/pack/contact_place.hpp"

namespace palpate {

inline constexpr uint32_t kMostBetween = 3;
inline constexpr uint32_t kMostBlended = 27;

// Whether a contact, one of so many, acts at the site nearest to it, and not at the corners of its place.
inline bool acts_at_site(const pal_contact& contact, uint32_t count) {
  return count > kMostBetween || is_at_site(contact);
}

// Contacts, the corners of their places, and the sets that these make.
struct LinearBlend {
  bool ready;
  uint32_t num_contacts;
  uint32_t fixed_version;
  uint32_t* num_corners;        // [max_contacts]
  uint32_t* corners;            // [max_contacts][3] sites
  uint32_t num_sets;            // the product of num_corners
  uint32_t num_found;           // of them: the next one is being made
  uint32_t sets[kMostBlended];  // of LinearState::sets
  uint32_t num_held;            // by any set
  uint32_t* held;               // [max_shown] contact nodes
  uint32_t* places;             // for each set, [num_held] of that set: where in `held` its nodes are
  // Of the last place_contacts() or place_difference()
  double weights[kMostBlended];  // of the sets
  double* own_stiffness;         // [max_contacts][3][3] of S
};

// One blend answers while another is made ready, if need be over several frames.
struct LinearState {
  uint32_t max_shown;  // nodes that a blend holds
  uint32_t num_sets;   // of kMostBetween contacts at most, and behind them two of more
  uint32_t num_more;
  LinearSet* sets;
  LinearBlend active;
  LinearBlend next;
  LinearAssembly assembly;
  uint64_t num_begun;   // blends
  uint32_t num_fixed;   // nodes, of the blend begun last
  uint32_t* fixed;      // [max_fixed]
  double* nodal_force;  // f of the last frame at the nodes held by the blend, [max_shown][3]
  double* set_force;    // f of one set: [stride]
  // Contacts with given forces
  double* given_factor;    // [3 max_contacts][3 max_contacts]
  uint32_t* given_axes;    // [3 max_contacts] of given force, ascending
  double* given_solution;  // [3 max_contacts]
  uint32_t* held_of;       // [num_contact_nodes] place in LinearBlend::held + 1, while that is filled
};

// Takes the arrays of a state that serves these capacities.
void carve_linear(const pal_pack& pack, uint32_t max_contacts, uint32_t max_fixed, Arena& arena,
                  LinearState& state);

// Whether a blend is, or will be, for these contacts and fixed nodes.
bool is_for(const LinearBlend& blend, const pal_contact* contacts, uint32_t count, uint32_t fixed_version);

// Begins to make the next blend, for these contacts and fixed nodes. `count` and `num_fixed` are within the
// capacities, sites and nodes exist.
void begin_linear(const pal_contact* contacts, uint32_t count, const uint32_t* fixed, uint32_t num_fixed,
                  uint32_t fixed_version, LinearState& state);

// Goes on with it for about so many multiply-adds, as advance_set() does. Once it is ready it answers, and true is
// returned.
bool advance_linear(const pal_pack& pack, uint64_t operations, LinearState& state);

// The next blend, if it is ready, answers, and the one that did is next.
void swap_blends(LinearState& state);

// Takes in where contacts are in the blend that answers, which is for them.
void place_contacts(const pal_contact* contacts, LinearState& state);

// The same for what contacts at their places have beyond contacts at `sites`, corners of theirs: the weight of the set
// of those is less by 1, so that all sum up to 0. Cost of both: 9 multiply-adds for each set and contact.
void place_difference(const pal_contact* contacts, const uint32_t* sites, LinearState& state);

// What a frame asks of the blend that answers, and its answer; model units.
struct LinearFrame {
  const uint32_t*
      given_axes;  // [count] bits 0 to 2: axes along which the force of a contact is given; null: none
  const double* given_forces;  // [count][3] read there
  const double* gravity_turn;  // [3] null: it has not turned
  const double* turn_before;   // [3] null: as gravity_turn
  double* displacements;       // [count][3] filled in where forces are given
  double* forces;              // [count][3]
  double energy;               // W
  double energy_before;        // what W would be with turn_before
  uint32_t flags;              // of sets, and of what is doubtful about the displacements
};

// Of contacts that were placed. Also leaves f for the field in `state`. Cost in multiply-adds: for each set 3 c (3 c
// + n), c contacts, n = 3 x the nodes it holds.
void evaluate_linear(const pal_pack& pack, LinearState& state, LinearFrame& frame);

// The 3 x 3 of S of two contacts, by rows; that of the other order is its transpose to the bit.
void stiffness_between(const pal_pack& pack, const LinearState& state, uint32_t row, uint32_t column,
                       double block[9]);

}  // namespace palpate
