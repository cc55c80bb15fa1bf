#include "runtime/src/linear/linear_blend.hpp"

#include <string.h>

#include <algorithm>

#include "runtime/src/numerics/semidefinite_cholesky.hpp"
#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

constexpr uint32_t kCorners = 3;

// Lists the sites whose answers are blended for one of `count` contacts. Returns their number.
uint32_t list_corners(const pal_contact& contact, uint32_t count, uint32_t corners[kCorners]) {
  if (acts_at_site(contact, count)) {
    corners[0] = nearest_site(contact);
    return 1;
  }
  const ContactPlace place = place_of(contact);
  for (uint32_t i = 0; i < place.count; ++i) corners[i] = place.corners[i].site;
  return place.count;
}

// Returns the index of a site among the corners of a contact, or num_corners.
uint32_t find_corner(const LinearBlend& blend, uint32_t contact, uint32_t site) {
  const uint32_t* corners = blend.corners + size_t{kCorners} * contact;
  return static_cast<uint32_t>(std::find(corners, corners + blend.num_corners[contact], site) - corners);
}

// Lists the sites of set `number`. The first contact's corner varies fastest.
void list_sites(const LinearBlend& blend, uint32_t number, uint32_t* sites) {
  for (uint32_t c = 0; c < blend.num_contacts; ++c) {
    sites[c] = blend.corners[kCorners * c + number % blend.num_corners[c]];
    number /= blend.num_corners[c];
  }
}

// Multiplies the sets' products by one more contact's weights, in the order of list_sites(). Corner 0 comes
// last, because it overwrites the products that the other corners read.
void add_contact(const double weights[kCorners], uint32_t num_corners, uint32_t length, double* products) {
  for (uint32_t corner = num_corners; corner-- > 0;) {
    for (uint32_t i = 0; i < length; ++i) products[corner * length + i] = products[i] * weights[corner];
  }
}

// Finds the next set of the blend in preparation. If no ready set has the sites, begins to assemble the least
// recently used set for these sites.
void find_set(const pal_pack& pack, LinearState& state) {
  LinearBlend& blend = state.next;
  const uint32_t count = blend.num_contacts;
  uint32_t sites[pack::kMostContacts];
  list_sites(blend, blend.num_found, sites);
  const bool is_between = count <= kMostBetween;
  const uint32_t end = state.num_sets + (is_between ? 0 : state.num_site_sets);
  uint32_t chosen = is_between ? 0 : state.num_sets;
  bool is_prepared = false;
  for (uint32_t i = chosen; i < end && !is_prepared; ++i) {
    const LinearSet& set = state.sets[i];
    is_prepared = set.ready && set.num_contacts == count && set.fixed_version == blend.fixed_version &&
                  std::equal(sites, sites + count, set.sites);
    if (is_prepared || set.last_used < state.sets[chosen].last_used) chosen = i;
  }
  blend.sets[blend.num_found++] = chosen;
  LinearSet& set = state.sets[chosen];
  set.last_used = state.num_begun;
  if (is_prepared) return;
  set.fixed_version = blend.fixed_version;
  begin_set(pack, sites, count, state.fixed, state.num_fixed, set, state.assembly);
}

// Lists the nodes that any set of the blend holds.
void list_held(LinearState& state) {
  LinearBlend& blend = state.next;
  uint32_t* place = blend.places;
  blend.num_held = 0;
  for (uint32_t i = 0; i < blend.num_sets; ++i) {
    const LinearSet& set = state.sets[blend.sets[i]];
    for (uint32_t slot = 0; slot < set.num_held; ++slot) {
      uint32_t& place_plus_one = state.held_of[set.held[slot]];
      if (place_plus_one == 0) {
        blend.held[blend.num_held] = set.held[slot];
        place_plus_one = ++blend.num_held;
      }
      *place++ = place_plus_one - 1;
    }
  }
  for (uint32_t i = 0; i < blend.num_held; ++i) state.held_of[blend.held[i]] = 0;
}

// Calls visit(weight, set, places) for each set with a weight.
template <typename Visit>
void for_each_set(const LinearState& state, Visit&& visit) {
  const LinearBlend& blend = state.active;
  const uint32_t* places = blend.places;
  for (uint32_t i = 0; i < blend.num_sets; ++i) {
    const LinearSet& set = state.sets[blend.sets[i]];
    if (blend.weights[i] != 0) visit(blend.weights[i], set, places);
    places += set.num_held;
  }
}

// The weight of each set is the product of its corners' weights.
void weigh_sets(const pal_contact* contacts, LinearBlend& blend) {
  uint32_t length = 1;
  blend.weights[0] = 1;
  for (uint32_t c = 0; c < blend.num_contacts && blend.num_sets > 1; ++c) {
    const ContactPlace place = place_of(contacts[c]);
    double weights[kCorners] = {};
    for (uint32_t i = 0; i < place.count; ++i)
      weights[find_corner(blend, c, place.corners[i].site)] += place.corners[i].weight;
    add_contact(weights, blend.num_corners[c], length, blend.weights);
    length *= blend.num_corners[c];
  }
}

void sum_own_stiffness(LinearState& state) {
  LinearBlend& blend = state.active;
  const uint32_t size = 9 * blend.num_contacts;
  memset(blend.own_stiffness, 0, size * sizeof *blend.own_stiffness);
  for_each_set(state, [&](double weight, const LinearSet& set, const uint32_t*) {
    for (uint32_t i = 0; i < size; ++i) blend.own_stiffness[i] += weight * set.own_stiffness[i];
  });
}

// Computes S_PP, upper triangle, with P the axes of given force. A row of S is E^T times a row of X
// (linear_dd.hpp): it sums the nodal forces of a unit displacement over each contact's nodes.
void gather_given(const pal_pack& pack, const uint32_t* axes, uint32_t count, LinearState& state) {
  memset(state.semidefinite_factor, 0, size_t{count} * count * sizeof *state.semidefinite_factor);
  for_each_set(state, [&](double weight, const LinearSet& set, const uint32_t*) {
    for (uint32_t k = 0; k < count; ++k) {
      const double* forces = set.unit_forces + axes[k] * set.stride;
      double contact_force[3];
      for (uint32_t j = k; j < count; ++j) {
        if (j == k || axes[j] / 3 != axes[j - 1] / 3)
          sum_patch(pack, set, axes[j] / 3, forces, contact_force);
        state.semidefinite_factor[size_t{k} * count + j] += weight * contact_force[axes[j] % 3];
      }
    }
  });
}

// f = X d - Y t and F = E^T f, with X and E of linear_dd.hpp, Y and the change t of gravity of gravity.hpp.
// If the only set has the weight 0, f keeps its former value.
void apply_displacements(const pal_pack& pack, LinearState& state, LinearFrame& frame) {
  const uint32_t num_contacts = state.active.num_contacts;
  const bool is_blended = state.active.num_sets > 1;
  if (is_blended) memset(state.nodal_force, 0, size_t{3} * state.active.num_held * sizeof *state.nodal_force);
  memset(frame.forces, 0, size_t{3} * num_contacts * sizeof *frame.forces);
  for_each_set(state, [&](double weight, const LinearSet& set, const uint32_t* places) {
    const uint32_t n = 3 * set.num_held;
    double* f = is_blended ? state.set_force : state.nodal_force;
    state.assembly.inverse.kernel.combine(set.unit_forces, set.stride, 3 * num_contacts, frame.displacements,
                                          n, f);
    for (uint32_t axis = 0; axis < 3 && frame.gravity_turn != nullptr; ++axis) {
      const double* forces = set.gravity_forces + size_t{axis} * n;
      for (uint32_t i = 0; i < n; ++i) f[i] -= frame.gravity_turn[axis] * forces[i];
    }
    for (uint32_t c = 0; c < num_contacts; ++c) {
      double force[3];
      sum_patch(pack, set, c, f, force);
      for (uint32_t i = 0; i < 3; ++i) frame.forces[3 * c + i] += weight * force[i];
    }
    for (uint32_t slot = 0; slot < set.num_held && is_blended; ++slot) {
      double* sum = state.nodal_force + size_t{3} * places[slot];
      for (uint32_t i = 0; i < 3; ++i) sum[i] += weight * f[3 * slot + i];
    }
  });
}

// Solves S_PP d_P = F_P - (force from other axes and gravity at d_P = 0), with P the axes of given force.
void solve_for_displacements(const pal_pack& pack, LinearState& state, LinearFrame& frame) {
  if (frame.given_axes == nullptr) return;
  uint32_t count = 0;
  for (uint32_t i = 0; i < 3 * state.active.num_contacts; ++i) {
    if ((frame.given_axes[i / 3] >> (i % 3) & 1) == 0) continue;
    state.given_axes[count++] = i;
    frame.displacements[i] = 0;
  }
  apply_displacements(pack, state, frame);
  double* x = state.given_solution;
  for (uint32_t k = 0; k < count; ++k) {
    const uint32_t axis = state.given_axes[k];
    x[k] = frame.given_forces[axis] - frame.forces[axis];
  }
  gather_given(pack, state.given_axes, count, state);
  constexpr double kRelativePivot = 1e-12;  // of its diagonal entry; a smaller pivot counts as 0
  if (!factor_semidefinite(count, kRelativePivot, state.semidefinite_factor))
    frame.flags |= PAL_FLAG_ILL_CONDITIONED;
  solve_semidefinite(state.semidefinite_factor, count, x);
  for (uint32_t k = 0; k < count; ++k) frame.displacements[state.given_axes[k]] = x[k];
}

// Returns d . E^T Y t with t = `turn`: the work of the change of gravity at the contacts.
double work_of_turn(const pal_pack& pack, const LinearState& state, const LinearFrame& frame,
                    const double turn[3]) {
  double work = 0;
  for_each_set(state, [&](double weight, const LinearSet& set, const uint32_t*) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      for (uint32_t c = 0; c < set.num_contacts; ++c) {
        double force[3];
        sum_patch(pack, set, c, set.gravity_forces + size_t{3} * axis * set.num_held, force);
        for (uint32_t i = 0; i < 3; ++i)
          work += weight * turn[axis] * force[i] * frame.displacements[3 * c + i];
      }
    }
  });
  return work;
}

// W = (d . S d - 2 d . E^T Y t + t . Z t) / 2 with t = `turn` and d . S d = `twice_elastic`.
double energy_with_turn(const pal_pack& pack, const LinearState& state, const LinearFrame& frame,
                        double twice_elastic, const double turn[3]) {
  double twice = twice_elastic - 2 * work_of_turn(pack, state, frame, turn);
  for_each_set(state, [&](double weight, const LinearSet& set, const uint32_t*) {
    for (uint32_t i = 0; i < 9; ++i) twice += weight * turn[i / 3] * set.gravity_own[i] * turn[i % 3];
  });
  return 0.5 * twice;
}

}  // namespace

void carve_linear(const pal_pack& pack, uint32_t max_contacts, uint32_t max_fixed, Arena& arena,
                  LinearState& state) {
  const uint32_t between = std::min(max_contacts, kMostBetween);
  // Shared nodes count once.
  const auto held_by = [&](uint32_t num_patches) {
    return static_cast<uint32_t>(
        std::min<uint64_t>(uint64_t{num_patches} * pack.max_patch_nodes + max_fixed, pack.num_contact_nodes));
  };
  const uint32_t held_between = held_by(between);
  const uint32_t max_held = held_by(max_contacts);
  state = {};
  state.max_shown = std::max(max_held, held_by(kCorners * between));
  uint32_t most_blended = 1;
  for (uint32_t c = 0; c < between; ++c) most_blended *= kCorners;
  state.num_sets = 2 * most_blended;  // the active blend and the next blend share no set
  state.num_site_sets = max_contacts > between ? 2 : 0;
  state.sets = arena.take<LinearSet>(state.num_sets + state.num_site_sets);
  for (uint32_t i = 0; i < state.num_sets + state.num_site_sets; ++i) {
    const LinearSet set = i < state.num_sets ? carve_set(pack, between, held_between, arena)
                                             : carve_set(pack, max_contacts, max_held, arena);
    if (state.sets != nullptr) state.sets[i] = set;
  }
  for (LinearBlend* blend : {&state.active, &state.next}) {
    blend->num_corners = arena.take<uint32_t>(max_contacts);
    blend->corners = arena.take<uint32_t>(size_t{kCorners} * max_contacts);
    blend->held = arena.take<uint32_t>(state.max_shown);
    blend->own_stiffness = arena.take<double>(size_t{9} * max_contacts);
    blend->places = arena.take<uint32_t>(std::max(size_t{max_held}, size_t{most_blended} * held_between));
  }
  carve_assembly(pack, max_held, arena, state.assembly);
  const size_t axes = size_t{3} * max_contacts;
  state.fixed = arena.take<uint32_t>(max_fixed);
  state.nodal_force = arena.take<double>(inverse_stride(state.max_shown));
  state.set_force = arena.take<double>(inverse_stride(max_held));
  state.semidefinite_factor = arena.take<double>(axes * axes);
  state.given_axes = arena.take<uint32_t>(axes);
  state.given_solution = arena.take<double>(axes);
  state.held_of = arena.take<uint32_t>(pack.num_contact_nodes);
}

bool is_for(const LinearBlend& blend, const pal_contact* contacts, uint32_t count, uint32_t fixed_version) {
  if (blend.num_contacts != count || blend.fixed_version != fixed_version) return false;
  for (uint32_t c = 0; c < count; ++c) {
    uint32_t corners[kCorners];
    const uint32_t num_corners = list_corners(contacts[c], count, corners);
    for (uint32_t i = 0; i < num_corners; ++i) {
      if (find_corner(blend, c, corners[i]) == blend.num_corners[c]) return false;
    }
  }
  return true;
}

void begin_linear(const pal_contact* contacts, uint32_t count, const uint32_t* fixed, uint32_t num_fixed,
                  uint32_t fixed_version, LinearState& state) {
  LinearBlend& blend = state.next;
  blend.ready = false;
  blend.num_contacts = count;
  blend.fixed_version = fixed_version;
  blend.num_found = 0;
  blend.num_sets = 1;
  for (uint32_t c = 0; c < count; ++c) {
    blend.num_corners[c] = list_corners(contacts[c], count, blend.corners + size_t{kCorners} * c);
    blend.num_sets *= blend.num_corners[c];
  }
  state.num_fixed = num_fixed;
  memcpy(state.fixed, fixed, num_fixed * sizeof *fixed);
  state.assembly.set = nullptr;
  ++state.num_begun;
  // The sets of the active blend must not be replaced.
  const LinearBlend& active = state.active;
  for (uint32_t i = 0; i < active.num_sets; ++i) state.sets[active.sets[i]].last_used = state.num_begun;
}

bool advance_linear(const pal_pack& pack, uint64_t operations, LinearState& state) {
  LinearBlend& blend = state.next;
  for (uint64_t spent = 0; spent < operations;) {
    if (state.assembly.set != nullptr && !state.assembly.set->ready) {
      spent += advance_set(pack, operations - spent, state.assembly);
    } else if (blend.num_found < blend.num_sets) {
      find_set(pack, state);
    } else {
      list_held(state);
      blend.ready = true;
      swap_blends(state);
      return true;
    }
  }
  return false;
}

void swap_blends(LinearState& state) {
  std::swap(state.active, state.next);
}

void place_contacts(const pal_contact* contacts, LinearState& state) {
  weigh_sets(contacts, state.active);
  sum_own_stiffness(state);
}

void place_difference(const pal_contact* contacts, const uint32_t* sites, LinearState& state) {
  LinearBlend& blend = state.active;
  weigh_sets(contacts, blend);
  uint32_t number = 0;  // of the set of `sites`
  for (uint32_t c = blend.num_contacts; c-- > 0;)
    number = number * blend.num_corners[c] + find_corner(blend, c, sites[c]);
  blend.weights[number] -= 1;
  sum_own_stiffness(state);
}

void evaluate_linear(const pal_pack& pack, LinearState& state, LinearFrame& frame) {
  frame.flags = 0;
  for_each_set(state, [&](double, const LinearSet& set, const uint32_t*) { frame.flags |= set.flags; });
  solve_for_displacements(pack, state, frame);
  apply_displacements(pack, state, frame);
  double twice = 0;
  for (uint32_t i = 0; i < 3 * state.active.num_contacts; ++i)
    twice += frame.forces[i] * frame.displacements[i];
  frame.energy = frame.energy_before = 0.5 * twice;  // F.d / 2, which equals d.S d / 2 without turned gravity
  if (frame.gravity_turn == nullptr && frame.turn_before == nullptr) return;
  constexpr double kNone[3] = {};
  const double* now = frame.gravity_turn != nullptr ? frame.gravity_turn : kNone;
  const double twice_elastic = twice + work_of_turn(pack, state, frame, now);  // d . S d
  frame.energy = energy_with_turn(pack, state, frame, twice_elastic, now);
  frame.energy_before = frame.turn_before != nullptr
                            ? energy_with_turn(pack, state, frame, twice_elastic, frame.turn_before)
                            : frame.energy;
}

void stiffness_between(const pal_pack& pack, const LinearState& state, uint32_t row, uint32_t column,
                       double block[9]) {
  memset(block, 0, 9 * sizeof *block);
  for_each_set(state, [&](double weight, const LinearSet& set, const uint32_t*) {
    double set_block[9];
    stiffness_between(pack, set, row, column, set_block);
    for (uint32_t i = 0; i < 9; ++i) block[i] += weight * set_block[i];
  });
}

}  // namespace palpate
