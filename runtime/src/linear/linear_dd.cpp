#include "runtime/src/linear/linear_dd.hpp"

#include <string.h>

#include "runtime/src/pack/compressed_compliance.hpp"
#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

// Appends a contact node to the nodes of the set.
void want(uint32_t contact_node, double share, LinearAssembly& assembly) {
  assembly.wanted[assembly.num_wanted] = contact_node;
  assembly.share[assembly.num_wanted] = share;
  assembly.wanted_of[contact_node] = ++assembly.num_wanted;
}

// Whether assembling M anew, 6 n^2 for each node that stays, costs less than removing nodes, 3 n^2 each.
bool is_cheaper_anew(const LinearAssembly& assembly) {
  const ContactStiffness& inverse = assembly.inverse;
  double stay = 0;
  for (uint32_t slot = 0; slot < inverse.num_nodes; ++slot)
    stay += assembly.wanted_of[inverse.nodes[slot]] != 0 ? 1 : 0;
  const double all = inverse.num_nodes;
  return all * all * all - stay * stay * stay > 2 * stay * stay * stay;
}

uint32_t patch_size(const pal_pack& pack, uint32_t site) {
  return pack.patch_starts[site + 1] - pack.patch_starts[site];
}

void begin_phase(LinearAssembly::Phase phase, LinearAssembly& assembly) {
  assembly.phase = phase;
  assembly.index = 0;
}

// Fills in E: the slots and shares of each patch's nodes.
void list_patches(const pal_pack& pack, const LinearAssembly& assembly, LinearSet& set) {
  for (uint32_t c = 0; c < set.num_contacts; ++c) {
    const size_t first = size_t{c} * pack.max_patch_nodes;
    const uint32_t* nodes = pack.patch_nodes + pack.patch_starts[set.sites[c]];
    for (uint32_t p = 0; p < patch_size(pack, set.sites[c]); ++p) {
      set.patch_slots[first + p] = assembly.inverse.slot_of[nodes[p]] - 1;
      set.patch_shares[first + p] = assembly.share[assembly.wanted_of[nodes[p]] - 1];
    }
  }
}

// Computes a column of X = M E: the sum of the patch's rows of M, each times its share.
void sum_unit_forces(const pal_pack& pack, uint32_t column, const ContactStiffness& inverse, LinearSet& set) {
  const uint32_t n = 3 * set.num_held;
  double* forces = set.unit_forces + column * set.stride;
  const uint32_t contact = column / 3;
  const size_t first = size_t{contact} * pack.max_patch_nodes;
  for (uint32_t p = 0; p < patch_size(pack, set.sites[contact]); ++p) {
    const double share = set.patch_shares[first + p];
    const double* row = inverse_row(inverse, set.patch_slots[first + p], column % 3);
    if (p == 0) {
      for (uint32_t i = 0; i < n; ++i) forces[i] = share * row[i];
    } else {
      for (uint32_t i = 0; i < n; ++i) forces[i] += share * row[i];
    }
  }
}

// Computes Y = M G_H and Z = G_H^T Y (gravity.hpp).
void sum_gravity(const pal_pack& pack, ContactStiffness& inverse, LinearSet& set) {
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

// Cost of fetching a block, in multiply-adds: a dense block misses the caches, a compressed block is a
// product of columns.
uint64_t fetch_cost(const pal_pack& pack) {
  return is_compressed(pack) ? 250 : 36;
}

// A step of Phase::remove. `index` runs over the slots. When a node leaves, its slot holds another node and
// is checked again. Returns the cost, as the steps below.
uint64_t remove_next(LinearAssembly& assembly) {
  ContactStiffness& inverse = assembly.inverse;
  const uint64_t n = uint64_t{3} * inverse.num_nodes;
  if (assembly.index >= inverse.num_nodes) {
    begin_phase(LinearAssembly::Phase::add, assembly);
  } else if (assembly.wanted_of[inverse.nodes[assembly.index]] != 0) {
    ++assembly.index;
  } else if (remove_node(assembly.index, inverse)) {
    return 3 * n * n;
  }
  return 0;
}

uint64_t add_next(const pal_pack& pack, LinearAssembly& assembly) {
  ContactStiffness& inverse = assembly.inverse;
  const uint64_t n = uint64_t{3} * inverse.num_nodes;
  if (assembly.index >= assembly.num_wanted) {
    begin_phase(LinearAssembly::Phase::correct, assembly);
  } else if (const uint32_t node = assembly.wanted[assembly.index++]; inverse.slot_of[node] == 0) {
    add_node(pack, node, inverse);
    return 6 * n * n + fetch_cost(pack) * inverse.num_nodes;
  }
  return 0;
}

// Corrects M and lists E, or begins M anew if the correction fails.
uint64_t correct(const pal_pack& pack, LinearAssembly& assembly) {
  LinearSet& set = *assembly.set;
  ContactStiffness& inverse = assembly.inverse;
  const uint64_t n = uint64_t{3} * inverse.num_nodes;
  const uint64_t cost = is_correction_due(inverse) ? 9 * n * n + fetch_cost(pack) * inverse.num_nodes : 0;
  if (correct_inverse(pack, inverse) || assembly.began_anew) {
    if (inverse.num_regularised > 0) set.flags |= PAL_FLAG_ILL_CONDITIONED;
    memcpy(set.held, inverse.nodes, inverse.num_nodes * sizeof *set.held);
    list_patches(pack, assembly, set);
    begin_phase(LinearAssembly::Phase::unit_forces, assembly);
  } else {
    assembly.began_anew = true;
    remove_all_nodes(inverse);
    begin_phase(LinearAssembly::Phase::add, assembly);
  }
  return cost;
}

}  // namespace

LinearSet carve_set(const pal_pack& pack, uint32_t max_contacts, uint32_t max_held, Arena& arena) {
  LinearSet set = {};
  set.sites = arena.take<uint32_t>(max_contacts);
  set.held = arena.take<uint32_t>(max_held);
  set.patch_slots = arena.take<uint32_t>(size_t{max_contacts} * pack.max_patch_nodes);
  set.patch_shares = arena.take<double>(size_t{max_contacts} * pack.max_patch_nodes);
  set.stride = inverse_stride(max_held);
  set.unit_forces = arena.take<double>(size_t{3} * max_contacts * set.stride);
  set.own_stiffness = arena.take<double>(size_t{9} * max_contacts);
  if (pack.contact_per_gravity != nullptr) set.gravity_forces = arena.take<double>(size_t{9} * max_held);
  return set;
}

void carve_assembly(const pal_pack& pack, uint32_t max_held, Arena& arena, LinearAssembly& assembly) {
  assembly.wanted = arena.take<uint32_t>(max_held);
  assembly.share = arena.take<double>(max_held);
  assembly.wanted_of = arena.take<uint32_t>(pack.num_contact_nodes);
  carve_inverse(pack, max_held, arena, assembly.inverse);
}

void begin_set(const pal_pack& pack, const uint32_t* sites, uint32_t count, const uint32_t* fixed,
               uint32_t num_fixed, LinearSet& set, LinearAssembly& assembly) {
  for (uint32_t i = 0; i < assembly.num_wanted; ++i) assembly.wanted_of[assembly.wanted[i]] = 0;
  assembly.num_wanted = 0;
  assembly.set = &set;
  set.ready = false;
  set.num_contacts = count;
  set.flags = 0;
  for (uint32_t i = 0; i < num_fixed; ++i) {
    if (assembly.wanted_of[fixed[i]] == 0) want(fixed[i], 0.0, assembly);
  }
  for (uint32_t c = 0; c < count; ++c) {
    const uint32_t site = sites[c];
    set.sites[c] = site;
    for (uint32_t p = pack.patch_starts[site]; p < pack.patch_starts[site + 1]; ++p) {
      const uint32_t place = assembly.wanted_of[pack.patch_nodes[p]];
      if (place == 0) {
        want(pack.patch_nodes[p], 1.0, assembly);
      } else if (assembly.share[place - 1] > 0) {
        set.flags |= PAL_FLAG_OVERLAPPING;
        assembly.share[place - 1] = 1.0 / (1.0 / assembly.share[place - 1] + 1.0);
      }
    }
  }
  set.num_held = assembly.num_wanted;
  // Nodes with springs may be leaving, so M begins anew.
  if (assembly.inverse.num_regularised > 0 || is_cheaper_anew(assembly)) remove_all_nodes(assembly.inverse);
  begin_phase(LinearAssembly::Phase::remove, assembly);
  assembly.began_anew = assembly.inverse.num_nodes == 0;
}

uint64_t advance_set(const pal_pack& pack, uint64_t operations, LinearAssembly& assembly) {
  using Phase = LinearAssembly::Phase;
  LinearSet& set = *assembly.set;
  ContactStiffness& inverse = assembly.inverse;
  uint64_t spent = 0;
  while (spent < operations && !set.ready) {
    switch (assembly.phase) {
      case Phase::remove:
        spent += remove_next(assembly);
        break;
      case Phase::add:
        spent += add_next(pack, assembly);
        break;
      case Phase::correct:
        spent += correct(pack, assembly);
        break;
      case Phase::unit_forces:
        if (assembly.index >= 3 * set.num_contacts) {
          begin_phase(Phase::own_stiffness, assembly);
        } else {
          sum_unit_forces(pack, assembly.index++, inverse, set);
          spent += uint64_t{3} * inverse.num_nodes * pack.max_patch_nodes;
        }
        break;
      case Phase::own_stiffness:
        if (assembly.index < set.num_contacts) {
          stiffness_between(pack, set, assembly.index, assembly.index,
                            set.own_stiffness + size_t{9} * assembly.index);
          ++assembly.index;
          spent += uint64_t{36} * pack.max_patch_nodes;
        } else {
          begin_phase(Phase::gravity, assembly);
        }
        break;
      case Phase::gravity:
        if (pack.contact_per_gravity != nullptr) sum_gravity(pack, inverse, set);
        set.ready = true;
        break;
    }
  }
  return spent;
}

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

void stiffness_between(const pal_pack& pack, const LinearSet& set, uint32_t row, uint32_t column,
                       double block[9]) {
  for (uint32_t i = 0; i < 3; ++i) {
    double at_column[3];  // force of `column` per displacement of `row`
    double at_row[3];     // force of `row` per displacement of `column`
    sum_patch(pack, set, column, set.unit_forces + (size_t{3} * row + i) * set.stride, at_column);
    for (uint32_t j = 0; j < 3; ++j) {
      sum_patch(pack, set, row, set.unit_forces + (size_t{3} * column + j) * set.stride, at_row);
      block[3 * i + j] = 0.5 * (at_column[j] + at_row[i]);
    }
  }
}

}  // namespace palpate
