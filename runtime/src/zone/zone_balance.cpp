#include "runtime/src/zone/zone_balance.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

constexpr double kFarthest = 1e4;  // displacement of any node, in units of the scene's largest

const double* at_rest(const ZoneFrame& frame, uint32_t place) {
  return frame.pack.zone_nodes[frame.set.nodes[place]].displacement;
}

// w_B, [boundary_stride].
void find_boundary(const ZoneFrame& frame, const ZoneGroup& group, double* moved) {
  memset(moved, 0, group.boundary_stride * sizeof *moved);
  for (uint32_t b = 0; b < group.num_boundary; ++b) {
    const uint32_t place = first_boundary(group) + b;
    const double* rest = at_rest(frame, place);
    for (uint32_t axis = 0; axis < 3; ++axis)
      moved[3 * b + axis] = frame.set.displacement[3 * place + axis] - rest[axis];
  }
}

// w_B less that of the delivery, [boundary_stride].
void find_move(const ZoneFrame& frame, const ZoneGroup& group, double* moved) {
  const size_t first = size_t{3} * first_boundary(group);
  memset(moved, 0, group.boundary_stride * sizeof *moved);
  for (size_t i = 0; i < size_t{3} * group.num_boundary; ++i) {
    if (frame.set.unknown_of[first_boundary(group) + i / 3] == kNoUnknown) continue;
    moved[i] = frame.set.displacement[first + i] - frame.set.correction.displacement_then[first + i];
  }
}

// Adds the product of `blocks`, between the group's boundary and those of the others, one behind the other, with the vector
// that vector_of(other group) returns.
template <typename VectorOf>
void add_of_others(const ZoneFrame& frame, const ZoneGroup& group, const double* blocks, VectorOf&& vector_of,
                   double* sum) {
  const size_t stride = group.boundary_stride;
  for (uint32_t g = 0; g < frame.set.num_groups; ++g) {
    const ZoneGroup& other = frame.set.groups[g];
    if (&other == &group) continue;
    frame.state.kernel.add_product(blocks, group.boundary_stride, group.boundary_stride,
                                   3 * other.num_boundary, vector_of(other), sum);
    blocks += stride * 3 * other.num_boundary;
  }
}

// b.
void find_move_by_others(const ZoneFrame& frame, const ZoneGroup& group) {
  memset(group.moved_by_others, 0, group.boundary_stride * sizeof *group.moved_by_others);
  const auto traction = [&](const ZoneGroup& other) -> const double* {
    return frame.set.traction + size_t{3} * first_boundary(other);
  };
  add_of_others(frame, group, group.compliances, traction, group.moved_by_others);
}

// T x = (S + S_int) x, at rest.
void add_organ_force(const ZoneState& state, const ZoneGroup& group, const double* x, double* force) {
  for (const double* matrix : {group.exterior_at_rest, group.own})
    state.kernel.add_symmetric_product(matrix, group.boundary_stride, x, force);
}

}  // namespace

bool evaluate_group(ZoneFrame& frame, ZoneGroup& group) {
  ZoneState& state = frame.state;
  const double* u = frame.set.displacement;
  const double limit = kFarthest * frame.pack.max_displacement;
  const uint32_t end = group.first_node + group.num_nodes;
  for (uint32_t place = group.first_node; place < end; ++place) {
    const double* rest = at_rest(frame, place);
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const uint32_t i = 3 * place + axis;
      if (!(fabs(u[i] - rest[axis]) <= limit)) return false;
      state.forces[i] = -frame.set.rest_force[i];
    }
  }
  const ZoneStrain strain = add_zone_forces(group.batches, u, state.forces);
  group.energy = strain.energy;
  if (!(strain.smallest_jacobian > kLeastJacobian)) return false;
  find_exterior_force(frame, group);
  return true;
}

void find_exterior_force(ZoneFrame& frame, ZoneGroup& group) {
  ZoneState& state = frame.state;
  find_boundary(frame, group, state.boundary);
  memset(group.exterior_force, 0, group.boundary_stride * sizeof *group.exterior_force);
  state.kernel.add_symmetric_product(group.exterior, group.boundary_stride, state.boundary,
                                     group.exterior_force);
}

void find_coupling(ZoneFrame& frame, ZoneGroup& group) {
  ZoneState& state = frame.state;
  const ZoneSet& set = frame.set;
  const uint32_t stride = group.boundary_stride;
  memset(group.coupled, 0, stride * sizeof *group.coupled);
  group.others_moved = group.coupled_change = 0;
  if (set.num_groups == 1) return;
  if (group.couplings == nullptr) {
    memcpy(state.vector, group.moved_by_others, stride * sizeof *state.vector);
    find_move_by_others(frame, group);
    add_organ_force(state, group, group.moved_by_others, group.coupled);
    for (uint32_t i = 0; i < stride; ++i) {
      group.coupled[i] = -group.coupled[i];
      group.coupled_change = std::max(group.coupled_change, fabs(group.moved_by_others[i] - state.vector[i]));
    }
    return;
  }
  const auto displacement = [&](const ZoneGroup& other) -> const double* {
    find_boundary(frame, other, state.vector);
    return state.vector;
  };
  add_of_others(frame, group, group.couplings, displacement, group.coupled);
}

void find_outside(ZoneFrame& frame, const ZoneGroup& group) {
  ZoneState& state = frame.state;
  find_boundary(frame, group, state.boundary);
  for (uint32_t i = 0; i < group.boundary_stride; ++i)
    state.outside[i] = group.exterior_force[i] + group.coupled[i];
  const double* correction = frame.set.correction.force + size_t{3} * first_boundary(group);
  for (uint32_t i = 0; i < 3 * group.num_boundary; ++i) state.outside[i] += correction[i];
}

void find_residual(ZoneFrame& frame, const ZoneGroup& group) {
  ZoneState& state = frame.state;
  const ZoneSet& set = frame.set;
  find_outside(frame, group);
  double* residual = state.residual;
  const uint32_t free = group.num_interior + group.num_boundary;
  const double* forces = state.forces + size_t{3} * group.first_node;
  memcpy(residual, forces, size_t{3} * free * sizeof *residual);
  for (uint32_t i = 0; i < 3 * group.num_boundary; ++i)
    residual[3 * group.num_interior + i] += state.outside[i];
  for (uint32_t i = 0; i < free; ++i) {
    const uint32_t axes = moving_axes(frame.pack, set, group.first_node + i);
    for (uint32_t axis = 0; axis < 3 && axes != 7; ++axis) {
      if ((axes >> axis & 1) == 0) residual[3 * i + axis] = 0;
    }
  }
  const uint32_t end = group.unknowns + group.num_axes;
  memset(residual + size_t{3} * free, 0, (end - 3 * free) * sizeof *residual);
  for (uint32_t slot = 0; slot < group.num_contacts; ++slot)
    memset(set.turning[group.contacts[slot]], 0, sizeof *set.turning);
  for (uint32_t i = free; i < free + group.num_held; ++i) {
    const uint32_t place = group.first_node + i;
    for (uint32_t m = set.first_master[place]; m < set.first_master[place + 1]; ++m) {
      const ZoneMaster& master = set.masters[m];
      double force[3];
      for (uint32_t axis = 0; axis < 3; ++axis) {
        force[axis] = master.share * forces[3 * i + axis];
        residual[master.unknown + axis] += force[axis];
      }
      if (master.turn == kNoUnknown) continue;
      add_cross(master.arm, force, residual + master.turn);
      // (dw x a) x f = a (f . dw) - (a . f) dw
      double* turning = set.turning[group.contacts[(master.unknown - group.unknowns) / 3]];
      for (uint32_t row = 0; row < 3; ++row) {
        for (uint32_t column = 0; column < 3; ++column) {
          turning[3 * row + column] += master.arm[row] * force[column];
          turning[4 * row] -= master.arm[column] * force[column];
        }
      }
    }
  }
}

// Sets t to zero where it exceeds any tissue's force, as with a compliance that is positive definite in each group alone.
void find_traction(ZoneFrame& frame, const ZoneGroup& group, bool since_delivery) {
  constexpr double kMostMoved =
      1e4;  // in units of what moves this node alone by the scene's largest displacement
  ZoneState& state = frame.state;
  const uint32_t stride = group.boundary_stride;
  double* t = state.residual;
  double* moved = state.boundary;
  memset(t, 0, stride * sizeof *t);
  if (since_delivery) {
    find_move(frame, group, moved);
    state.kernel.add_symmetric_product(group.exterior, stride, moved, t);
    state.kernel.add_symmetric_product(group.own, stride, moved, t);
    const auto move = [&](const ZoneGroup& other) -> const double* {
      find_move(frame, other, state.vector);
      return state.vector;
    };
    add_of_others(frame, group, group.couplings, move, t);
  } else {
    find_boundary(frame, group, moved);
    for (uint32_t i = 0; i < stride; ++i) moved[i] -= group.moved_by_others[i];
    add_organ_force(state, group, moved, t);
  }
  bool sound = true;
  for (uint32_t i = 0; i < 3 * group.num_boundary; ++i) {
    const size_t diagonal = size_t{i} * stride + i;
    const double stiffness = group.exterior_at_rest[diagonal] + group.own[diagonal];
    sound = sound && fabs(t[i]) <= kMostMoved * frame.pack.max_displacement * stiffness;
  }
  double* to = frame.set.traction + size_t{3} * first_boundary(group);
  const size_t bytes = size_t{3} * group.num_boundary * sizeof *t;
  if (sound) {
    memcpy(to, t, bytes);
  } else {
    memset(to, 0, bytes);
    frame.flags |= PAL_FLAG_NOT_FINITE;
  }
}

void find_tractions_from_rest(ZoneFrame& frame) {
  constexpr uint32_t kSweeps = 4;
  const ZoneSet& set = frame.set;
  memset(set.traction, 0, size_t{3} * set.num_nodes * sizeof *set.traction);
  for (uint32_t sweep = 0; sweep < (set.num_groups > 1 ? kSweeps : 1); ++sweep) {
    for (uint32_t g = 0; g < set.num_groups; ++g) {
      find_move_by_others(frame, set.groups[g]);
      find_traction(frame, set.groups[g], false);
    }
  }
}

double outside_energy(const ZoneFrame& frame, const ZoneGroup& group) {
  const double* correction = frame.set.correction.force + size_t{3} * first_boundary(group);
  double energy = 0;
  for (uint32_t i = 0; i < 3 * group.num_boundary; ++i)
    energy += 0.5 * frame.state.boundary[i] * (frame.state.outside[i] + correction[i]);
  return energy;
}

double stored_energy(const ZoneFrame& frame, const ZoneGroup& group) {
  const ZoneSet& set = frame.set;
  double energy = group.energy + outside_energy(frame, group);
  for (uint32_t place = group.first_node; place < group.first_node + group.num_nodes; ++place) {
    const double* rest = at_rest(frame, place);
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const uint32_t i = 3 * place + axis;
      energy -= set.rest_force[i] * (set.displacement[i] - rest[axis]);
    }
  }
  return energy;
}

}  // namespace palpate
