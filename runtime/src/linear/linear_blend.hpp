// linear_dd of contacts anywhere on the surface: a blend of the linear_dd answers at the sites around them.
//
// Contact c has the weights w_ci at the sites i of its triangle's corners (contact_place.hpp). S_ij.. is the
// stiffness of contacts at sites i, j, .. (linear_dd.hpp). With the same displacements d at all corners,
//
//   F = S d,  S = sum over i, j, .. of w_1i w_2j .. S_ij..
//
// with one term for each choice of corners; energy, field and gravity use the same sum. The response is:
// - continuous along any path of a contact,
// - the gradient of an energy,
// - exact at sites.
//
// The sum has 3, 9 or 27 sets of sites. More contacts than kMostBetween act at their nearest sites, which is
// one set.
//
// Each set stays until another set replaces it: a contact that slides into the next triangle needs only the
// sets with the new corner. Each set starts from the contact stiffness of the set before.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/linear/linear_dd.hpp"
#include "runtime/src/pack/contact_place.hpp"

namespace palpate {

inline constexpr uint32_t kMostBetween = 3;
inline constexpr uint32_t kMostBlended = 27;

// Whether one of `count` contacts acts at its nearest site, instead of the corners of its place.
inline bool acts_at_site(const pal_contact& contact, uint32_t count) {
  return count > kMostBetween || is_at_site(contact);
}

// Contacts, the corners of their places, and the sets of corners.
struct LinearBlend {
  bool ready;
  uint32_t num_contacts;
  uint32_t fixed_version;
  uint32_t* num_corners;        // [max_contacts]
  uint32_t* corners;            // [max_contacts][3] sites
  uint32_t num_sets;            // the product of num_corners
  uint32_t num_found;           // sets found so far: the next set is in preparation
  uint32_t sets[kMostBlended];  // indices in LinearState::sets
  uint32_t num_held;            // nodes that any set holds
  uint32_t* held;               // [max_shown] contact nodes
  uint32_t* places;             // for each set, [num_held of the set] places of its nodes in `held`
  // Results of the last place_contacts() or place_difference():
  double weights[kMostBlended];  // weights of the sets
  double* own_stiffness;         // [max_contacts][3][3] diagonal blocks of S
};

// One blend answers during the preparation of the next blend, which may take several frames.
struct LinearState {
  uint32_t max_shown;      // capacity of a blend's held nodes
  uint32_t num_sets;       // sets of up to kMostBetween contacts: the first in `sets`
  uint32_t num_site_sets;  // sets of more contacts, each at its nearest site: the next in `sets`
  LinearSet* sets;
  LinearBlend active;
  LinearBlend next;
  LinearAssembly assembly;
  uint64_t num_begun;   // number of blends begun, the time of LinearSet::last_used
  uint32_t num_fixed;   // fixed nodes of the blend begun last
  uint32_t* fixed;      // [max_fixed]
  double* nodal_force;  // f of the last frame at the blend's held nodes, [max_shown][3]
  double* set_force;    // f of one set: [stride]
  // Contacts with given forces:
  double* semidefinite_factor;  // [3 max_contacts][3 max_contacts]
  uint32_t* given_axes;         // [3 max_contacts] axes of given force, ascending
  double* given_solution;       // [3 max_contacts]
  uint32_t* held_of;            // [num_contact_nodes] scratch: place in LinearBlend::held + 1
};

void carve_linear(const pal_pack& pack, uint32_t max_contacts, uint32_t max_fixed, Arena& arena,
                  LinearState& state);

// Whether a blend serves these contacts and fixed nodes, now or after its preparation.
bool is_for(const LinearBlend& blend, const pal_contact* contacts, uint32_t count, uint32_t fixed_version);

// Begins the next blend for these contacts and fixed nodes. The caller has checked the capacities and that
// the sites and nodes exist.
void begin_linear(const pal_contact* contacts, uint32_t count, const uint32_t* fixed, uint32_t num_fixed,
                  uint32_t fixed_version, LinearState& state);

// Advances the next blend by about `operations` multiply-adds, as advance_set() does. Returns true once the
// blend is ready and active.
bool advance_linear(const pal_pack& pack, uint64_t operations, LinearState& state);

void swap_blends(LinearState& state);

// Sets the weights of the active blend for these contacts.
void place_contacts(const pal_contact* contacts, LinearState& state);

// Sets the weights for the difference between contacts at their places and contacts at `sites`. The set of
// `sites` has its weight less 1, so that all weights sum to 0.
void place_difference(const pal_contact* contacts, const uint32_t* sites, LinearState& state);

// Input and output of the active blend in a frame; model units.
struct LinearFrame {
  const uint32_t* given_axes;  // [count] bits 0 to 2: axes of given force; null: none
  const double* given_forces;  // [count][3] read along given_axes
  const double* gravity_turn;  // [3] t of gravity.hpp; null: 0
  const double* turn_before;   // [3] t of the last frame; null: as gravity_turn
  double* displacements;       // [count][3] filled in along given_axes
  double* forces;              // [count][3]
  double energy;               // W
  double energy_before;        // W with turn_before
  uint32_t flags;              // flags of the sets and of doubtful displacements
};

// Evaluates the active blend after place_contacts(), and leaves f for the field in `state`. Cost of a set:
// 3 c (3 c + n) multiply-adds, with c contacts and n = 3 x the nodes held.
void evaluate_linear(const pal_pack& pack, LinearState& state, LinearFrame& frame);

// The 3 x 3 block of S for two contacts, by rows. The block of (column, row) is its transpose to the bit.
void stiffness_between(const pal_pack& pack, const LinearState& state, uint32_t row, uint32_t column,
                       double block[9]);

}  // namespace palpate
