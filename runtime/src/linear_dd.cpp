#include "runtime/src/linear_dd.hpp"

#include <string.h>

#include <math.h>

#include <initializer_list>

#include "runtime/src/compressed_compliance.hpp"
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

// Column of X = M E: the sum of the rows of M that belong to the patch.
void sum_unit_forces(const pal_pack& pack, uint32_t column, LinearState& state) {
  LinearSet& set = state.next;
  const uint32_t n = 3 * set.num_held;
  double* forces = set.unit_forces + size_t{column} * n;
  memset(forces, 0, n * sizeof *forces);
  const uint32_t site = set.sites[column / 3];
  for (uint32_t p = pack.patch_starts[site]; p < pack.patch_starts[site + 1]; ++p) {
    const uint32_t node = pack.patch_nodes[p];
    const double share = state.share[state.wanted_of[node] - 1];
    const double* row = inverse_row(state.inverse, state.inverse.slot_of[node] - 1, column % 3);
    for (uint32_t i = 0; i < n; ++i) forces[i] += share * row[i];
  }
}

// Row of S = E^T X, up to its diagonal; symmetric but for rounding, of which the mean of both is taken.
void sum_stiffness(const pal_pack& pack, uint32_t row, LinearState& state) {
  LinearSet& set = state.next;
  const uint32_t n = 3 * set.num_held;
  const uint32_t size = 3 * set.num_contacts;
  const auto entry = [&](uint32_t i, uint32_t j) {
    const uint32_t site = set.sites[i / 3];
    const double* forces = set.unit_forces + size_t{j} * n;
    double sum = 0;
    for (uint32_t p = pack.patch_starts[site]; p < pack.patch_starts[site + 1]; ++p) {
      const uint32_t node = pack.patch_nodes[p];
      const uint32_t slot = state.inverse.slot_of[node] - 1;
      sum += state.share[state.wanted_of[node] - 1] * forces[3 * slot + i % 3];
    }
    return sum;
  };
  for (uint32_t column = 0; column <= row; ++column) {
    set.stiffness[size_t{row} * size + column] = set.stiffness[size_t{column} * size + row] =
        row == column ? entry(row, row) : 0.5 * (entry(row, column) + entry(column, row));
  }
}

// S_PP = U^T U in place of the upper triangle of `factor`, P the axes of given force. An axis along which no
// force moves anything, as of a contact wholly on fixed nodes, gets no entry: false.
bool factor_given(const LinearSet& set, const uint32_t* axes, uint32_t count, double* factor) {
  constexpr double kSmallestPivot = 1e-12;
  const uint32_t size = 3 * set.num_contacts;
  bool is_whole = true;
  for (uint32_t k = 0; k < count; ++k) {
    double* row = factor + size_t{k} * count;
    for (uint32_t j = k; j < count; ++j) row[j] = set.stiffness[size_t{axes[k]} * size + axes[j]];
    const double own = row[k];
    for (uint32_t i = 0; i < k; ++i) {
      const double* above = factor + size_t{i} * count;
      for (uint32_t j = k; j < count; ++j) row[j] -= above[k] * above[j];
    }
    if (!(row[k] > kSmallestPivot * own)) {
      is_whole = false;
      for (uint32_t j = k; j < count; ++j) row[j] = 0;
      continue;
    }
    const double inverse = 1.0 / sqrt(row[k]);
    for (uint32_t j = k; j < count; ++j) row[j] *= inverse;
  }
  return is_whole;
}

// x := (U^T U)^-1 x, zero where there is no pivot.
void solve_given(const double* factor, uint32_t count, double* x) {
  for (uint32_t k = 0; k < count; ++k) {
    const double* row = factor + size_t{k} * count;
    x[k] = row[k] > 0 ? x[k] / row[k] : 0.0;
    for (uint32_t j = k + 1; j < count; ++j) x[j] -= row[j] * x[k];
  }
  for (uint32_t k = count; k-- > 0;) {
    const double* row = factor + size_t{k} * count;
    double sum = x[k];
    for (uint32_t j = k + 1; j < count; ++j) sum -= row[j] * x[j];
    x[k] = row[k] > 0 ? sum / row[k] : 0.0;
  }
}

// Fills in the displacements along the axes of given force.
uint32_t solve_for_displacements(const uint32_t* given_axes, const double* given_forces,
                                 double* displacements, LinearState& state, double* forces) {
  const LinearSet& set = state.answering;
  const uint32_t size = 3 * set.num_contacts;
  uint32_t count = 0;
  for (uint32_t i = 0; i < size; ++i) {
    if ((given_axes[i / 3] >> (i % 3) & 1) == 0) continue;
    state.given_axes[count++] = i;
    displacements[i] = 0;
  }
  if (count == 0) return 0;
  double* x = forces;  // which are not known yet
  for (uint32_t k = 0; k < count; ++k) {
    const uint32_t row = state.given_axes[k];
    double sum = given_forces[row];
    for (uint32_t j = 0; j < size; ++j) sum -= set.stiffness[size_t{row} * size + j] * displacements[j];
    x[k] = sum;
  }
  const bool is_whole = factor_given(set, state.given_axes, count, state.given_factor);
  solve_given(state.given_factor, count, x);
  for (uint32_t k = 0; k < count; ++k) displacements[state.given_axes[k]] = x[k];
  return is_whole ? 0 : PAL_FLAG_ILL_CONDITIONED;
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
    set->unit_forces = arena.take<double>(axes * dofs);
    set->stiffness = arena.take<double>(axes * axes);
  }
  state.nodal_force = arena.take<double>(dofs);
  state.wanted = arena.take<uint32_t>(state.max_held);
  state.share = arena.take<double>(state.max_held);
  state.wanted_of = arena.take<uint32_t>(pack.num_contact_nodes);
  carve_inverse(pack, state.max_held, arena, state.inverse);
  state.given_factor = arena.take<double>(axes * axes);
  state.given_axes = arena.take<uint32_t>(axes);
}

bool is_for(const LinearSet& set, const pal_contact* contacts, uint32_t count, uint32_t fixed_version) {
  if (set.num_contacts != count || set.fixed_version != fixed_version) return false;
  for (uint32_t c = 0; c < count; ++c) {
    if (set.sites[c] != contacts[c].site) return false;
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
    set.sites[c] = contacts[c].site;
    for (uint32_t p = pack.patch_starts[contacts[c].site]; p < pack.patch_starts[contacts[c].site + 1]; ++p) {
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
        spent += 9 * n * n;
        if (correct_inverse(pack, inverse) || state.began_anew) {
          if (inverse.num_regularised > 0) set.flags |= PAL_FLAG_ILL_CONDITIONED;
          memcpy(set.held, inverse.nodes, inverse.num_nodes * sizeof *set.held);
          go_to(Phase::unit_forces);
        } else {
          state.began_anew = true;
          remove_all_nodes(inverse);
          go_to(Phase::add);
        }
        break;
      case Phase::unit_forces:
        if (state.index >= size) {
          go_to(Phase::stiffness);
        } else {
          sum_unit_forces(pack, state.index++, state);
          spent += n * pack.max_patch_nodes;
        }
        break;
      case Phase::stiffness:
        if (state.index < size) {
          sum_stiffness(pack, state.index++, state);
          spent += uint64_t{2} * state.index * pack.max_patch_nodes;
        } else {
          set.ready = true;
          swap_sets(state);
          return true;
        }
        break;
    }
  }
  return false;
}

uint32_t evaluate_linear(const uint32_t* given_axes, const double* given_forces, double* displacements,
                         LinearState& state, double* forces) {
  const LinearSet& set = state.answering;
  const uint32_t size = 3 * set.num_contacts;
  const uint32_t n = 3 * set.num_held;
  const uint32_t flags = solve_for_displacements(given_axes, given_forces, displacements, state, forces);
  for (uint32_t row = 0; row < size; ++row) {
    double sum = 0;
    for (uint32_t column = 0; column < size; ++column)
      sum += set.stiffness[size_t{row} * size + column] * displacements[column];
    forces[row] = sum;
  }
  memset(state.nodal_force, 0, n * sizeof *state.nodal_force);
  for (uint32_t column = 0; column < size; ++column) {
    const double* unit = set.unit_forces + size_t{column} * n;
    for (uint32_t i = 0; i < n; ++i) state.nodal_force[i] += displacements[column] * unit[i];
  }
  return flags;
}

}  // namespace palpate
