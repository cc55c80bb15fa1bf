#include "runtime/src/linear_dd.hpp"

#include <string.h>

#include <math.h>

#include "runtime/src/pack_view.hpp"

namespace palpate {
namespace {

// A compliance keeps 16 digits less those of the condition of K, 3 to 5 on organ meshes. A pivot below this
// part of its diagonal entry is therefore noise: the node moves as others already do.
constexpr double kSmallestPivot = 1e-11;
// Then this part of the mean diagonal is added to all of it: a soft spring of a billionth of the local
// compliance at every held node, whose forces change by about the same fraction where the set was
// well-conditioned. If that is not enough, a stiffer one; and last n^2, which always is where
// |a_ij| <= sqrt(a_ii a_jj), as checked at open: no row then outweighs its diagonal (Gershgorin).
constexpr double kRegularisations[] = {1e-9, 1e-5, 0.0 /* n^2 */};

constexpr uint32_t kAttempts = 1 + sizeof kRegularisations / sizeof *kRegularisations;

// One row of U^T U = A in place on the upper triangle: row k is final before row k + 1 is touched, and every
// inner loop runs along a row. False when the pivot vanishes; the matrix is then spoilt.
bool factor_row(double* matrix, uint32_t n, uint32_t k) {
  double* row_k = matrix + size_t{k} * n;
  // The diagonal's own size is kept below it, where the factor has no entry.
  const double original = k == 0 ? row_k[k] : matrix[size_t{k} * n];
  if (!(row_k[k] > kSmallestPivot * original)) return false;
  const double root = sqrt(row_k[k]);
  const double inverse = 1.0 / root;
  row_k[k] = root;
  for (uint32_t j = k + 1; j < n; ++j) row_k[j] *= inverse;
  for (uint32_t i = k + 1; i < n; ++i) {
    double* row_i = matrix + size_t{i} * n;
    const double factor = row_k[i];
    for (uint32_t j = i; j < n; ++j) row_i[j] -= factor * row_k[j];
  }
  return true;
}

// x := A^-1 x.
void solve_in_place(const double* factor, uint32_t n, double* x) {
  for (uint32_t k = 0; k < n; ++k) {  // U^T y = x
    const double* row = factor + size_t{k} * n;
    x[k] /= row[k];
    for (uint32_t j = k + 1; j < n; ++j) x[j] -= row[j] * x[k];
  }
  for (uint32_t k = n; k-- > 0;) {  // U x = y
    const double* row = factor + size_t{k} * n;
    double sum = x[k];
    for (uint32_t j = k + 1; j < n; ++j) sum -= row[j] * x[j];
    x[k] = sum / row[k];
  }
}

double mean_diagonal(const pal_pack& pack, const LinearSet& set) {
  const size_t contact_dofs = size_t{3} * pack.num_contact_nodes;
  const uint32_t n = 3 * set.num_held;
  double mean = 0;
  for (uint32_t i = 0; i < n; ++i) {
    const size_t dof = size_t{3} * set.held[i / 3] + i % 3;
    mean += pack.contact_compliance[dof * contact_dofs + dof] / n;
  }
  return mean;
}

// Row i of A, from its diagonal on.
void gather_row(const pal_pack& pack, uint32_t i, LinearState& state) {
  const LinearSet& set = state.next;
  const uint32_t n = 3 * set.num_held;
  const size_t contact_dofs = size_t{3} * pack.num_contact_nodes;
  const double* source = pack.contact_compliance + (size_t{3} * set.held[i / 3] + i % 3) * contact_dofs;
  double* row = state.factor + size_t{i} * n;
  for (uint32_t j = i; j < n; ++j) row[j] = source[size_t{3} * set.held[j / 3] + j % 3];
  if (state.attempt > 0) {
    const double part = kRegularisations[state.attempt - 1];
    row[i] += (part > 0 ? part : static_cast<double>(n) * n) * state.mean_diagonal;
  }
  if (i > 0) row[0] = row[i];
}

// Column of X.
void solve_column(const pal_pack& pack, uint32_t column, LinearState& state) {
  LinearSet& set = state.next;
  const uint32_t n = 3 * set.num_held;
  double* forces = set.unit_forces + size_t{column} * n;
  memset(forces, 0, n * sizeof *forces);
  const uint32_t site = set.sites[column / 3];
  for (uint32_t p = pack.patch_starts[site]; p < pack.patch_starts[site + 1]; ++p) {
    const uint32_t slot = state.slot_of[pack.patch_nodes[p]] - 1;
    forces[3 * slot + column % 3] = set.share[slot];
  }
  solve_in_place(state.factor, n, forces);
}

// Row of S = E^T X, up to its diagonal; symmetric but for rounding, of which the mean of both is taken.
void sum_row(const pal_pack& pack, uint32_t row, LinearState& state) {
  LinearSet& set = state.next;
  const uint32_t n = 3 * set.num_held;
  const uint32_t size = 3 * set.num_contacts;
  const auto entry = [&](uint32_t i, uint32_t j) {
    const uint32_t site = set.sites[i / 3];
    const double* forces = set.unit_forces + size_t{j} * n;
    double sum = 0;
    for (uint32_t p = pack.patch_starts[site]; p < pack.patch_starts[site + 1]; ++p) {
      const uint32_t slot = state.slot_of[pack.patch_nodes[p]] - 1;
      sum += set.share[slot] * forces[3 * slot + i % 3];
    }
    return sum;
  };
  for (uint32_t column = 0; column <= row; ++column) {
    set.stiffness[size_t{row} * size + column] = set.stiffness[size_t{column} * size + row] =
        row == column ? entry(row, row) : 0.5 * (entry(row, column) + entry(column, row));
  }
}

void hold(uint32_t contact_node, double share, LinearState& state) {
  LinearSet& set = state.next;
  set.held[set.num_held] = contact_node;
  set.share[set.num_held] = share;
  state.slot_of[contact_node] = ++set.num_held;
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
  for (LinearSet* set : {&state.answering, &state.next}) {
    set->sites = arena.take<uint32_t>(max_contacts);
    set->held = arena.take<uint32_t>(state.max_held);
    set->share = arena.take<double>(state.max_held);
    set->unit_forces = arena.take<double>(size_t{3} * max_contacts * dofs);
    set->stiffness = arena.take<double>(size_t{9} * max_contacts * max_contacts);
  }
  state.nodal_force = arena.take<double>(dofs);
  state.slot_of = arena.take<uint32_t>(pack.num_contact_nodes);
  state.factor = arena.take<double>(dofs * dofs);
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
  memset(state.slot_of, 0, size_t{pack.num_contact_nodes} * sizeof *state.slot_of);
  LinearSet& set = state.next;
  set.ready = false;
  set.num_contacts = count;
  set.num_held = 0;
  set.fixed_version = fixed_version;
  set.flags = 0;
  for (uint32_t i = 0; i < num_fixed; ++i) {
    if (state.slot_of[fixed[i]] == 0) hold(fixed[i], 0.0, state);
  }
  for (uint32_t c = 0; c < count; ++c) {
    set.sites[c] = contacts[c].site;
    for (uint32_t p = pack.patch_starts[contacts[c].site]; p < pack.patch_starts[contacts[c].site + 1]; ++p) {
      const uint32_t slot = state.slot_of[pack.patch_nodes[p]];
      if (slot == 0) {
        hold(pack.patch_nodes[p], 1.0, state);
      } else if (set.share[slot - 1] > 0) {
        set.flags |= PAL_FLAG_OVERLAPPING;
        set.share[slot - 1] = 1.0 / (1.0 / set.share[slot - 1] + 1.0);
      }
    }
  }
  state.phase = LinearState::Phase::gather;
  state.index = 0;
  state.attempt = 0;
  state.mean_diagonal = 0;
}

void swap_sets(LinearState& state) {
  const LinearSet made = state.next;
  state.next = state.answering;
  state.answering = made;
}

bool advance_linear(const pal_pack& pack, uint64_t operations, LinearState& state) {
  using Phase = LinearState::Phase;
  LinearSet& set = state.next;
  const uint32_t n = 3 * set.num_held;
  const uint32_t size = 3 * set.num_contacts;
  // To fetch a number from all over the pack takes as long as several multiply-adds.
  constexpr uint64_t kFetch = 4;
  const auto go_to = [&](Phase phase) {
    state.phase = phase;
    state.index = 0;
  };
  for (uint64_t spent = 0; spent < operations;) {
    const uint32_t i = state.index++;
    switch (state.phase) {
      case Phase::gather:
        if (i < n) {
          gather_row(pack, i, state);
          spent += kFetch * (n - i);
        } else {
          go_to(Phase::factor);
        }
        break;
      case Phase::factor:
        if (i >= n) {
          go_to(Phase::solve);
        } else if (factor_row(state.factor, n, i)) {
          spent += uint64_t{n - i} * (n - i) / 2 + 1;
        } else if (state.attempt + 1 < kAttempts) {
          set.flags |= PAL_FLAG_ILL_CONDITIONED;
          if (++state.attempt == 1) state.mean_diagonal = mean_diagonal(pack, set);
          go_to(Phase::gather);
        }
        break;
      case Phase::solve:
        if (i < size) {
          solve_column(pack, i, state);
          spent += uint64_t{n} * n;
        } else {
          go_to(Phase::sum);
        }
        break;
      case Phase::sum:
        if (i < size) {
          sum_row(pack, i, state);
          spent += uint64_t{2} * (i + 1) * pack.max_patch_nodes;
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

void factor_for_calibration(double* matrix, uint32_t n) {
  for (uint32_t k = 1; k < n; ++k) matrix[size_t{k} * n] = matrix[size_t{k} * (n + 1)];
  for (uint32_t k = 0; k < n && factor_row(matrix, n, k); ++k) {
  }
}

void evaluate_linear(const double* displacements, LinearState& state, double* forces) {
  const LinearSet& set = state.answering;
  const uint32_t size = 3 * set.num_contacts;
  const uint32_t n = 3 * set.num_held;
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
}

void add_linear_field(const pal_pack& pack, const FieldState& field, uint32_t first, uint32_t count,
                      AddColumns add_columns, float* sum) {
  for (uint32_t slot = 0; slot < field.num_held; ++slot) {
    const float* columns = pack.field_compliance + size_t{3} * field.held[slot] * pack.field_stride;
    for (uint32_t panel = 0; panel < count; ++panel) {
      add_columns(columns + size_t{first + panel} * pack::kPanelRows, pack.field_stride,
                  field.weights + size_t{3} * slot, 3, sum + size_t{panel} * pack::kPanelRows);
    }
  }
}

}  // namespace palpate
