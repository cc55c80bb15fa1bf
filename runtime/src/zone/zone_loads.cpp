#include "runtime/src/zone/zone_loads.hpp"

#include <string.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

// K_P / force_scale, row-major: the load that moves the patch by 1 along each axis.
void stiffness_of_patch(const pal_pack& pack, uint32_t site, double stiffness[9]) {
  for (uint32_t i = 0; i < 9; ++i) {
    stiffness[i] = 0;
    for (uint32_t p = pack.patch_starts[site]; p < pack.patch_starts[site + 1]; ++p)
      stiffness[i] += pack.site_forces[size_t{9} * p + i] / pack.zone_force_scale[site];
  }
}

using Gram = double[3 * kMostZoneContacts][3 * kMostZoneContacts];

// Of what loads differ by, which the boundary hardly tells apart.
void add_ridge(uint32_t num_contacts, Gram gram) {
  constexpr double kShare = 5e-4;  // of the smaller load's own
  constexpr double kLeast = 1e-9;  // where the boundary does not tell of a load at all
  double own[kMostZoneContacts];
  double largest = 0;
  for (uint32_t c = 0; c < num_contacts; ++c) {
    own[c] = (gram[3 * c][3 * c] + gram[3 * c + 1][3 * c + 1] + gram[3 * c + 2][3 * c + 2]) / 3;
    largest = std::max(largest, own[c]);
  }
  for (uint32_t i = 0; i < 3 * num_contacts; ++i) {
    for (uint32_t j = i % 3; j < 3 * num_contacts; j += 3) {
      const double ridge = kShare * std::min(own[i / 3], own[j / 3]);
      gram[i][i] += ridge;
      gram[i][j] -= ridge;
    }
    gram[i][i] += kLeast * largest;
  }
}

// Adds to rows[3][stride] how the linear organ moves these nodes, [count][3], as it moves a patch alone by 1 along each axis.
void add_moves(const pal_pack& pack, uint32_t site, const uint32_t* nodes, uint32_t count, size_t stride,
               double* rows) {
  for (uint32_t p = pack.patch_starts[site]; p < pack.patch_starts[site + 1]; ++p) {
    const double* force = pack.site_forces + size_t{9} * p;
    for (uint32_t n = 0; n < count; ++n) {
      if (nodes[n] >= pack.num_zone_free) continue;
      double block[9];
      zone_compliance(pack, nodes[n], pack.patch_nodes[p], block);
      for (uint32_t i = 0; i < 9; ++i) {
        double& moved = rows[size_t{i % 3} * stride + 3 * n + i / 3];
        for (uint32_t k = 0; k < 3; ++k) moved += block[i / 3 * 3 + k] * force[3 * k + i % 3];
      }
    }
  }
}

// Makes of rows[3][stride], count of each, their products with factors[3][3].
void combine_rows(const double factors[9], uint32_t count, size_t stride, double* rows) {
  for (uint32_t k = 0; k < count; ++k) {
    const double from[3] = {rows[k], rows[stride + k], rows[2 * stride + k]};
    for (uint32_t i = 0; i < 3; ++i)
      rows[i * stride + k] =
          factors[3 * i] * from[0] + factors[3 * i + 1] * from[1] + factors[3 * i + 2] * from[2];
  }
}

// How far, and where to, a load of 1 along each axis moves the patch in the linear organ: row-major, length unit.
void displacement_of_load(const pal_pack& pack, uint32_t site, double per_load[9]) {
  double k[9];
  stiffness_of_patch(pack, site, k);
  double determinant = 0;
  for (uint32_t i = 0; i < 3; ++i) {
    for (uint32_t j = 0; j < 3; ++j) {
      const uint32_t row[2] = {3 * ((j + 1) % 3), 3 * ((j + 2) % 3)};
      const uint32_t column[2] = {(i + 1) % 3, (i + 2) % 3};
      per_load[3 * i + j] =
          k[row[0] + column[0]] * k[row[1] + column[1]] - k[row[0] + column[1]] * k[row[1] + column[0]];
    }
    determinant += k[i] * per_load[3 * i];
  }
  for (uint32_t i = 0; i < 9; ++i) per_load[i] /= determinant;
}

}  // namespace

bool fit_loads(const pal_pack& pack, uint64_t operations, uint32_t begin, ZoneState& state, ZoneGroup& group,
               uint64_t& spent) {
  const ZoneSet& set = state.next;
  const uint32_t count = group.num_fitted;
  const size_t stride = group.boundary_stride;
  const uint32_t moving = 3 * group.num_boundary;
  double* tractions = group.loads_of_tractions;
  double* moves = group.loads_of_moves;
  if (count == 0) return true;
  for (; state.column < begin + group.num_contacts; ++state.column) {  // V
    if (spent >= operations) return false;
    const uint32_t slot = state.column - begin;
    const uint32_t site = set.sites[group.contacts[slot]];
    memset(tractions + 3 * slot * stride, 0, 3 * stride * sizeof *tractions);
    add_moves(pack, site, set.nodes + first_boundary(group), group.num_boundary, stride,
              tractions + 3 * slot * stride);
    spent += kOfBlock * group.num_boundary * (pack.patch_starts[site + 1] - pack.patch_starts[site]);
  }
  for (; state.column < begin + group.num_contacts + count; ++state.column) {
    if (spent >= operations) return false;
    const size_t row = (state.column - begin - group.num_contacts) * stride;
    memset(moves + row, 0, stride * sizeof *moves);
    if (moving > 0)
      state.kernel.add_symmetric_product(group.whole, group.boundary_stride, tractions + row, moves + row);
    spent += stride * stride;
  }
  if (moving == 0) return true;
  Gram gram;
  for (uint32_t i = 0; i < count; ++i) {
    for (uint32_t j = 0; j < count; ++j) {
      gram[i][j] = 0;
      for (uint32_t k = 0; k < moving; ++k) gram[i][j] += moves[i * stride + k] * tractions[j * stride + k];
    }
  }
  add_ridge(group.num_contacts, gram);
  // Gauss and Jordan: no pivots, as it is positive definite.
  const auto combine = [&](uint32_t to, double own, uint32_t from, double factor) {
    for (uint32_t j = 0; j < count; ++j) gram[to][j] = own * gram[to][j] + factor * gram[from][j];
    for (double* rows : {tractions, moves}) {
      for (uint32_t k = 0; k < moving; ++k)
        rows[to * stride + k] = own * rows[to * stride + k] + factor * rows[from * stride + k];
    }
  };
  for (uint32_t i = 0; i < count; ++i) {
    combine(i, 1 / gram[i][i], i, 0);
    for (uint32_t other = 0; other < count; ++other) {
      if (other != i) combine(other, 1, i, -gram[other][i]);
    }
  }
  // From displacements of the patches to loads.
  for (uint32_t row = 0; row < count; row += 3) {
    const uint32_t site = set.sites[group.contacts[row / 3]];
    double stiffness[9];
    stiffness_of_patch(pack, site, stiffness);
    for (double* rows : {tractions + row * stride, moves + row * stride})
      combine_rows(stiffness, moving, stride, rows);
  }
  spent += uint64_t{3} * count * count * moving;
  return true;
}

void find_moves_of_loads(const pal_pack& pack, uint32_t site, const uint32_t* nodes, uint32_t count,
                         size_t stride, double* rows) {
  memset(rows, 0, 3 * stride * sizeof *rows);
  add_moves(pack, site, nodes, count, stride, rows);
  double per_load[9];
  displacement_of_load(pack, site, per_load);
  combine_rows(per_load, 3 * count, stride, rows);  // symmetric
}

}  // namespace palpate
