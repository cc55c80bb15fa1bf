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

// U^T U = A in place on the upper triangle, by rows (row k is final before row k + 1 is touched, and every
// inner loop runs along a row). False when a pivot vanishes; the matrix is then spoilt.
bool factor_in_place(double* matrix, uint32_t n) {
  for (uint32_t k = 0; k < n; ++k) {
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

void gather_compliance(const pal_pack& pack, double regularisation, LinearState& state) {
  const uint32_t n = 3 * state.num_held;
  const size_t contact_dofs = size_t{3} * pack.num_contact_nodes;
  double mean_diagonal = 0;
  for (uint32_t i = 0; i < n; ++i) {
    const size_t dof = size_t{3} * state.held[i / 3] + i % 3;
    mean_diagonal += pack.contact_compliance[dof * contact_dofs + dof] / n;
  }
  for (uint32_t i = 0; i < n; ++i) {
    const double* source = pack.contact_compliance + (size_t{3} * state.held[i / 3] + i % 3) * contact_dofs;
    double* row = state.factor + size_t{i} * n;
    for (uint32_t j = i; j < n; ++j) row[j] = source[size_t{3} * state.held[j / 3] + j % 3];
    row[i] += regularisation * mean_diagonal;
    if (i > 0) row[0] = row[i];
  }
}

void hold(uint32_t contact_node, double share, LinearState& state) {
  state.held[state.num_held] = contact_node;
  state.share[state.num_held] = share;
  state.slot_of[contact_node] = ++state.num_held;
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
  state.sites = arena.take<uint32_t>(max_contacts);
  state.held = arena.take<uint32_t>(state.max_held);
  state.slot_of = arena.take<uint32_t>(pack.num_contact_nodes);
  state.share = arena.take<double>(state.max_held);
  state.factor = arena.take<double>(dofs * dofs);
  state.unit_forces = arena.take<double>(size_t{3} * max_contacts * dofs);
  state.stiffness = arena.take<double>(size_t{9} * max_contacts * max_contacts);
  state.nodal_force = arena.take<double>(dofs);
}

void prepare_linear(const pal_pack& pack, const pal_contact* contacts, uint32_t count, const uint32_t* fixed,
                    uint32_t num_fixed, LinearState& state) {
  memset(state.slot_of, 0, size_t{pack.num_contact_nodes} * sizeof *state.slot_of);
  state.num_contacts = count;
  state.num_held = 0;
  state.flags = 0;
  for (uint32_t i = 0; i < num_fixed; ++i) {
    if (state.slot_of[fixed[i]] == 0) hold(fixed[i], 0.0, state);
  }
  for (uint32_t c = 0; c < count; ++c) {
    state.sites[c] = contacts[c].site;
    for (uint32_t p = pack.patch_starts[contacts[c].site]; p < pack.patch_starts[contacts[c].site + 1]; ++p) {
      const uint32_t slot = state.slot_of[pack.patch_nodes[p]];
      if (slot == 0) {
        hold(pack.patch_nodes[p], 1.0, state);
      } else if (state.share[slot - 1] > 0) {
        state.flags |= PAL_FLAG_OVERLAPPING;
        state.share[slot - 1] = 1.0 / (1.0 / state.share[slot - 1] + 1.0);
      }
    }
  }

  const uint32_t n = 3 * state.num_held;
  gather_compliance(pack, 0.0, state);
  bool factored = factor_in_place(state.factor, n);
  for (size_t i = 0; !factored && i < sizeof kRegularisations / sizeof *kRegularisations; ++i) {
    state.flags |= PAL_FLAG_ILL_CONDITIONED;
    const double certain = static_cast<double>(n) * n;
    gather_compliance(pack, kRegularisations[i] > 0 ? kRegularisations[i] : certain, state);
    factored = factor_in_place(state.factor, n);
  }

  for (uint32_t column = 0; column < 3 * count; ++column) {
    double* forces = state.unit_forces + size_t{column} * n;
    memset(forces, 0, n * sizeof *forces);
    const uint32_t site = state.sites[column / 3];
    for (uint32_t p = pack.patch_starts[site]; p < pack.patch_starts[site + 1]; ++p) {
      const uint32_t slot = state.slot_of[pack.patch_nodes[p]] - 1;
      forces[3 * slot + column % 3] = state.share[slot];
    }
    solve_in_place(state.factor, n, forces);
  }
  for (uint32_t row = 0; row < 3 * count; ++row) {
    const uint32_t site = state.sites[row / 3];
    for (uint32_t column = 0; column < 3 * count; ++column) {
      const double* forces = state.unit_forces + size_t{column} * n;
      double sum = 0;
      for (uint32_t p = pack.patch_starts[site]; p < pack.patch_starts[site + 1]; ++p) {
        const uint32_t slot = state.slot_of[pack.patch_nodes[p]] - 1;
        sum += state.share[slot] * forces[3 * slot + row % 3];
      }
      state.stiffness[size_t{row} * 3 * count + column] = sum;
    }
  }
  for (uint32_t row = 0; row < 3 * count; ++row) {  // symmetric but for rounding: made so
    for (uint32_t column = 0; column < row; ++column) {
      double& lower = state.stiffness[size_t{row} * 3 * count + column];
      double& upper = state.stiffness[size_t{column} * 3 * count + row];
      lower = upper = 0.5 * (lower + upper);
    }
  }
  state.valid = true;
}

void evaluate_linear(const double* displacements, LinearState& state, double* forces) {
  const uint32_t size = 3 * state.num_contacts;
  const uint32_t n = 3 * state.num_held;
  for (uint32_t row = 0; row < size; ++row) {
    double sum = 0;
    for (uint32_t column = 0; column < size; ++column)
      sum += state.stiffness[size_t{row} * size + column] * displacements[column];
    forces[row] = sum;
  }
  memset(state.nodal_force, 0, n * sizeof *state.nodal_force);
  for (uint32_t column = 0; column < size; ++column) {
    const double* unit = state.unit_forces + size_t{column} * n;
    for (uint32_t i = 0; i < n; ++i) state.nodal_force[i] += displacements[column] * unit[i];
  }
}

void add_linear_field(const pal_pack& pack, const FieldState& field, uint32_t panel, AddColumns add_columns,
                      float* sum) {
  for (uint32_t slot = 0; slot < field.num_held; ++slot) {
    const float* columns = pack.field_compliance + size_t{3} * field.held[slot] * pack.field_stride +
                           size_t{panel} * pack::kPanelRows;
    add_columns(columns, pack.field_stride, field.weights + size_t{3} * slot, 3, sum);
  }
}

}  // namespace palpate
