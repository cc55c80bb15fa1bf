#include "runtime/src/linear_dd.hpp"

#include <string.h>

#include <math.h>

#include <initializer_list>

#include "runtime/src/compressed_compliance.hpp"
#include "runtime/src/contact_place.hpp"
#include "runtime/src/given_factor.hpp"
#include "runtime/src/pack_view.hpp"

namespace palpate {
namespace {

// Each node once, whoever holds it.
void want(uint32_t contact_node, double share, LinearState& state) {
  state.wanted[state.num_wanted] = contact_node;
  state.share[state.num_wanted] = share;
  state.wanted_of[contact_node] = ++state.num_wanted;
}

// Whether it costs less to begin from nothing than to take out of the inverse what is not wanted:
// 3 n^2 for each node that goes against 6 n^2 for each that stays, summed.
bool is_cheaper_anew(const LinearState& state) {
  const HeldInverse& inverse = state.inverse;
  double stay = 0;
  for (uint32_t slot = 0; slot < inverse.num_nodes; ++slot)
    stay += state.wanted_of[inverse.nodes[slot]] != 0 ? 1 : 0;
  const double all = inverse.num_nodes;
  return all * all * all - stay * stay * stay > 2 * stay * stay * stay;
}

uint32_t patch_size(const pal_pack& pack, uint32_t site) {
  return pack.patch_starts[site + 1] - pack.patch_starts[site];
}

// E of the next set.
void list_patches(const pal_pack& pack, LinearState& state) {
  const LinearSet& set = state.next;
  for (uint32_t c = 0; c < set.num_contacts; ++c) {
    const size_t first = size_t{c} * pack.max_patch_nodes;
    const uint32_t* nodes = pack.patch_nodes + pack.patch_starts[set.sites[c]];
    for (uint32_t p = 0; p < patch_size(pack, set.sites[c]); ++p) {
      set.patch_slots[first + p] = state.inverse.slot_of[nodes[p]] - 1;
      set.patch_shares[first + p] = state.share[state.wanted_of[nodes[p]] - 1];
    }
  }
}

// Column of X = M E: the sum of the rows of M that belong to the patch.
void sum_unit_forces(const pal_pack& pack, uint32_t column, LinearState& state) {
  LinearSet& set = state.next;
  const uint32_t n = 3 * set.num_held;
  double* forces = set.unit_forces + column * set.stride;
  const uint32_t contact = column / 3;
  const size_t first = size_t{contact} * pack.max_patch_nodes;
  for (uint32_t p = 0; p < patch_size(pack, set.sites[contact]); ++p) {
    const double share = set.patch_shares[first + p];
    const double* row = inverse_row(state.inverse, set.patch_slots[first + p], column % 3);
    if (p == 0) {
      for (uint32_t i = 0; i < n; ++i) forces[i] = share * row[i];
    } else {
      for (uint32_t i = 0; i < n; ++i) forces[i] += share * row[i];
    }
  }
}

// E^T f of one contact.
void sum_patch(const pal_pack& pack, const LinearSet& set, uint32_t contact, const double* nodal_force,
               double force[3]) {
  const size_t first = size_t{contact} * pack.max_patch_nodes;
  double x = 0;
  double y = 0;
  double z = 0;
  for (uint32_t p = 0; p < patch_size(pack, set.sites[contact]); ++p) {
    const double share = set.patch_shares[first + p];
    const double* from = nodal_force + size_t{3} * set.patch_slots[first + p];
    x += share * from[0];
    y += share * from[1];
    z += share * from[2];
  }
  force[0] = x;
  force[1] = y;
  force[2] = z;
}

// S_PP, upper triangle, P the axes of given force: a row of S is E^T of a row of X.
void gather_given(const pal_pack& pack, const LinearSet& set, const uint32_t* axes, uint32_t count,
                  double* matrix) {
  for (uint32_t k = 0; k < count; ++k) {
    const double* forces = set.unit_forces + axes[k] * set.stride;
    double of_contact[3];
    for (uint32_t j = k; j < count; ++j) {
      if (j == k || axes[j] / 3 != axes[j - 1] / 3) sum_patch(pack, set, axes[j] / 3, forces, of_contact);
      matrix[size_t{k} * count + j] = of_contact[axes[j] % 3];
    }
  }
}

// Y = M G_H and Z = G_H^T Y.
void sum_gravity(const pal_pack& pack, LinearState& state) {
  LinearSet& set = state.next;
  HeldInverse& inverse = state.inverse;
  const uint32_t n = 3 * set.num_held;
  const size_t stride = inverse.stride;
  for (uint32_t slot = 0; slot < set.num_held; ++slot) {
    const double* rows = pack.contact_per_gravity + size_t{9} * inverse.nodes[slot];
    for (uint32_t entry = 0; entry < 9; ++entry)
      inverse.columns[(entry % 3) * stride + 3 * slot + entry / 3] = rows[entry];
  }
  inverse.kernel.multiply(inverse.matrix, stride, set.num_held, inverse.columns, inverse.products);
  for (uint32_t axis = 0; axis < 3; ++axis) {
    const double* forces = inverse.products + axis * stride;
    memcpy(set.gravity_forces + size_t{axis} * n, forces, n * sizeof *forces);
    for (uint32_t other = 0; other < 3; ++other) {
      double sum = 0;
      for (uint32_t i = 0; i < n; ++i) sum += forces[i] * inverse.columns[other * stride + i];
      set.gravity_own[3 * axis + other] = sum;
    }
  }
}

// f = X d - Y t and F = E^T f.
void apply_displacements(const pal_pack& pack, LinearState& state, LinearFrame& frame) {
  const LinearSet& set = state.answering;
  const HeldInverse& inverse = state.inverse;
  const uint32_t n = 3 * set.num_held;
  inverse.kernel.combine(set.unit_forces, set.stride, 3 * set.num_contacts, frame.displacements, n,
                         state.nodal_force);
  for (uint32_t axis = 0; axis < 3 && frame.gravity_turn != nullptr; ++axis) {
    const double* forces = set.gravity_forces + size_t{axis} * n;
    for (uint32_t i = 0; i < n; ++i) state.nodal_force[i] -= frame.gravity_turn[axis] * forces[i];
  }
  for (uint32_t c = 0; c < set.num_contacts; ++c)
    sum_patch(pack, set, c, state.nodal_force, frame.forces + size_t{3} * c);
}

// Fills in the displacements along the axes of given force: S_PP d_P = F_P less what the others and gravity
// make there while d_P = 0.
void solve_for_displacements(const pal_pack& pack, LinearState& state, LinearFrame& frame) {
  if (frame.given_axes == nullptr) return;
  const LinearSet& set = state.answering;
  uint32_t count = 0;
  for (uint32_t i = 0; i < 3 * set.num_contacts; ++i) {
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
  gather_given(pack, set, state.given_axes, count, state.given_factor);
  constexpr double kLeastPart = 1e-12;
  if (!factor_given(count, kLeastPart, state.given_factor)) frame.flags = PAL_FLAG_ILL_CONDITIONED;
  solve_given(state.given_factor, count, x);
  for (uint32_t k = 0; k < count; ++k) frame.displacements[state.given_axes[k]] = x[k];
}

// d.Q t
double work_of_turn(const pal_pack& pack, const LinearSet& set, const LinearFrame& frame,
                    const double turn[3]) {
  const uint32_t n = 3 * set.num_held;
  double work = 0;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    for (uint32_t c = 0; c < set.num_contacts; ++c) {
      double force[3];
      sum_patch(pack, set, c, set.gravity_forces + size_t{axis} * n, force);
      for (uint32_t i = 0; i < 3; ++i) work += turn[axis] * force[i] * frame.displacements[3 * c + i];
    }
  }
  return work;
}

// W with gravity turned by `turn`; `still` is d.S d.
double energy_with_turn(const pal_pack& pack, const LinearSet& set, const LinearFrame& frame, double still,
                        const double turn[3]) {
  double twice = still - 2 * work_of_turn(pack, set, frame, turn);
  for (uint32_t i = 0; i < 9; ++i) twice += turn[i / 3] * set.gravity_own[i] * turn[i % 3];
  return 0.5 * twice;
}

}  // namespace

void carve_linear(const pal_pack& pack, uint32_t max_contacts, uint32_t max_fixed, Arena& arena,
                  LinearState& state) {
  uint64_t most = uint64_t{max_contacts} * pack.max_patch_nodes + max_fixed;
  if (most > pack.num_contact_nodes) most = pack.num_contact_nodes;  // a node is held once
  state = {};
  state.max_contacts = max_contacts;
  state.max_held = static_cast<uint32_t>(most);
  const size_t dofs = size_t{3} * state.max_held;
  const size_t axes = size_t{3} * max_contacts;
  for (LinearSet* set : {&state.answering, &state.next}) {
    set->sites = arena.take<uint32_t>(max_contacts);
    set->held = arena.take<uint32_t>(state.max_held);
    set->patch_slots = arena.take<uint32_t>(size_t{max_contacts} * pack.max_patch_nodes);
    set->patch_shares = arena.take<double>(size_t{max_contacts} * pack.max_patch_nodes);
    set->stride = inverse_stride(state.max_held);
    set->unit_forces = arena.take<double>(axes * set->stride);
    set->own_stiffness = arena.take<double>(size_t{9} * max_contacts);
    if (pack.contact_per_gravity != nullptr) set->gravity_forces = arena.take<double>(3 * dofs);
  }
  state.nodal_force = arena.take<double>(inverse_stride(state.max_held));
  state.wanted = arena.take<uint32_t>(state.max_held);
  state.share = arena.take<double>(state.max_held);
  state.wanted_of = arena.take<uint32_t>(pack.num_contact_nodes);
  carve_inverse(pack, state.max_held, arena, state.inverse);
  state.given_factor = arena.take<double>(axes * axes);
  state.given_axes = arena.take<uint32_t>(axes);
  state.given_solution = arena.take<double>(axes);
}

bool is_for(const LinearSet& set, const pal_contact* contacts, uint32_t count, uint32_t fixed_version) {
  if (set.num_contacts != count || set.fixed_version != fixed_version) return false;
  for (uint32_t c = 0; c < count; ++c) {
    if (set.sites[c] != nearest_site(contacts[c])) return false;
  }
  return true;
}

void begin_linear(const pal_pack& pack, const pal_contact* contacts, uint32_t count, const uint32_t* fixed,
                  uint32_t num_fixed, uint32_t fixed_version, LinearState& state) {
  for (uint32_t i = 0; i < state.num_wanted; ++i) state.wanted_of[state.wanted[i]] = 0;
  state.num_wanted = 0;
  LinearSet& set = state.next;
  set.ready = false;
  set.num_contacts = count;
  set.fixed_version = fixed_version;
  set.flags = 0;
  for (uint32_t i = 0; i < num_fixed; ++i) {
    if (state.wanted_of[fixed[i]] == 0) want(fixed[i], 0.0, state);
  }
  for (uint32_t c = 0; c < count; ++c) {
    const uint32_t site = nearest_site(contacts[c]);
    set.sites[c] = site;
    for (uint32_t p = pack.patch_starts[site]; p < pack.patch_starts[site + 1]; ++p) {
      const uint32_t place = state.wanted_of[pack.patch_nodes[p]];
      if (place == 0) {
        want(pack.patch_nodes[p], 1.0, state);
      } else if (state.share[place - 1] > 0) {
        set.flags |= PAL_FLAG_OVERLAPPING;
        state.share[place - 1] = 1.0 / (1.0 / state.share[place - 1] + 1.0);
      }
    }
  }
  set.num_held = state.num_wanted;
  // Springs are there for the sake of nodes that may be about to go.
  if (state.inverse.num_regularised > 0 || is_cheaper_anew(state)) remove_all_nodes(state.inverse);
  state.phase = LinearState::Phase::remove;
  state.index = 0;
  state.began_anew = state.inverse.num_nodes == 0;
}

void swap_sets(LinearState& state) {
  const LinearSet made = state.next;
  state.next = state.answering;
  state.answering = made;
}

bool advance_linear(const pal_pack& pack, uint64_t operations, LinearState& state) {
  using Phase = LinearState::Phase;
  LinearSet& set = state.next;
  HeldInverse& inverse = state.inverse;
  const uint32_t size = 3 * set.num_contacts;
  // To fetch a block from all over the pack takes as long as so many multiply-adds; from a compressed one it
  // is made, of some 24 columns.
  const uint64_t fetch = is_compressed(pack) ? 250 : 36;
  const auto go_to = [&](Phase phase) {
    state.phase = phase;
    state.index = 0;
  };
  for (uint64_t spent = 0; spent < operations;) {
    const uint64_t n = uint64_t{3} * inverse.num_nodes;
    switch (state.phase) {
      case Phase::remove:
        // From slot `index` on; what takes the place of a node that goes is looked at next.
        if (state.index >= inverse.num_nodes) {
          go_to(Phase::add);
        } else if (state.wanted_of[inverse.nodes[state.index]] != 0) {
          ++state.index;
        } else if (remove_node(state.index, inverse)) {
          spent += 3 * n * n;
        }
        break;
      case Phase::add:
        if (state.index >= state.num_wanted) {
          go_to(Phase::correct);
        } else if (const uint32_t node = state.wanted[state.index++]; inverse.slot_of[node] == 0) {
          add_node(pack, node, inverse);
          spent += 6 * n * n + fetch * (inverse.num_nodes);
        }
        break;
      case Phase::correct:
        if (is_correction_due(inverse)) spent += 9 * n * n + fetch * inverse.num_nodes;
        if (correct_inverse(pack, inverse) || state.began_anew) {
          if (inverse.num_regularised > 0) set.flags |= PAL_FLAG_ILL_CONDITIONED;
          memcpy(set.held, inverse.nodes, inverse.num_nodes * sizeof *set.held);
          list_patches(pack, state);
          go_to(Phase::unit_forces);
        } else {
          state.began_anew = true;
          remove_all_nodes(inverse);
          go_to(Phase::add);
        }
        break;
      case Phase::unit_forces:
        if (state.index >= size) {
          go_to(Phase::own_stiffness);
        } else {
          sum_unit_forces(pack, state.index++, state);
          spent += n * pack.max_patch_nodes;
        }
        break;
      case Phase::own_stiffness:
        if (state.index < set.num_contacts) {
          contact_stiffness(pack, set, state.index, state.index, set.own_stiffness + size_t{9} * state.index);
          ++state.index;
          spent += uint64_t{36} * pack.max_patch_nodes;
        } else {
          go_to(Phase::gravity);
        }
        break;
      case Phase::gravity:
        if (pack.contact_per_gravity != nullptr) sum_gravity(pack, state);
        set.ready = true;
        swap_sets(state);
        return true;
    }
  }
  return false;
}

void evaluate_linear(const pal_pack& pack, LinearState& state, LinearFrame& frame) {
  const LinearSet& set = state.answering;
  frame.flags = 0;
  solve_for_displacements(pack, state, frame);
  apply_displacements(pack, state, frame);
  double twice = 0;
  for (uint32_t i = 0; i < 3 * set.num_contacts; ++i) twice += frame.forces[i] * frame.displacements[i];
  frame.energy = frame.energy_before = 0.5 * twice;  // F.d / 2, which is d.S d / 2 where nothing turned
  if (frame.gravity_turn == nullptr && frame.turn_before == nullptr) return;
  constexpr double kNone[3] = {};
  const double* now = frame.gravity_turn != nullptr ? frame.gravity_turn : kNone;
  const double still = twice + work_of_turn(pack, set, frame, now);
  frame.energy = energy_with_turn(pack, set, frame, still, now);
  frame.energy_before = frame.turn_before != nullptr
                            ? energy_with_turn(pack, set, frame, still, frame.turn_before)
                            : frame.energy;
}

void contact_stiffness(const pal_pack& pack, const LinearSet& set, uint32_t row, uint32_t column,
                       double block[9]) {
  for (uint32_t i = 0; i < 3; ++i) {
    double one_way[3];
    double other_way[3];
    sum_patch(pack, set, column, set.unit_forces + (size_t{3} * row + i) * set.stride, one_way);
    for (uint32_t j = 0; j < 3; ++j) {
      sum_patch(pack, set, row, set.unit_forces + (size_t{3} * column + j) * set.stride, other_way);
      block[3 * i + j] = 0.5 * (one_way[j] + other_way[i]);
    }
  }
}

}  // namespace palpate
