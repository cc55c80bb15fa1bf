#include "runtime/src/zone/zone_balance.hpp"

#include <math.h>
#include <string.h>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

constexpr double kFarthest = 1e4;  // displacement of any node, in units of the scene's largest

const double* at_rest(const ZoneFrame& frame, uint32_t place) {
  return frame.pack.zone_nodes[frame.set.nodes[place]].displacement;
}

// w_B.
void find_boundary(const ZoneFrame& frame, const ZoneGroup& group) {
  double* moved = frame.state.boundary;
  memset(moved, 0, group.boundary_stride * sizeof *moved);
  for (uint32_t b = 0; b < group.num_boundary; ++b) {
    const uint32_t place = first_boundary(group) + b;
    const double* rest = at_rest(frame, place);
    for (uint32_t axis = 0; axis < 3; ++axis)
      moved[3 * b + axis] = frame.set.displacement[3 * place + axis] - rest[axis];
  }
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
  find_boundary(frame, group);
  memset(group.exterior_force, 0, group.boundary_stride * sizeof *group.exterior_force);
  state.kernel.add_symmetric_product(group.exterior, group.boundary_stride, state.boundary,
                                     group.exterior_force);
  return true;
}

void find_coupling(ZoneFrame& frame, ZoneGroup& group) {
  ZoneState& state = frame.state;
  const ZoneSet& set = frame.set;
  const uint32_t stride = group.boundary_stride;
  double* moved = state.vector;
  memset(moved, 0, stride * sizeof *moved);
  const double* coupling = group.couplings;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneGroup& other = set.groups[g];
    if (&other == &group) continue;
    state.kernel.add_product(coupling, stride, stride, 3 * other.num_boundary,
                             set.traction + size_t{3} * first_boundary(other), moved);
    coupling += size_t{stride} * 3 * other.num_boundary;
  }
  group.coupled_change = 0;
  for (uint32_t i = 0; i < stride; ++i) {
    const double change = fabs(moved[i] - group.coupled[i]);
    if (change > group.coupled_change) group.coupled_change = change;
    group.coupled[i] = moved[i];
  }
  double* pull = group.coupled + stride;
  memset(pull, 0, stride * sizeof *pull);
  state.kernel.add_symmetric_product(group.whole, stride, moved, pull);
  group.others_moved = 0;
}

void find_outside(ZoneFrame& frame, const ZoneGroup& group) {
  ZoneState& state = frame.state;
  find_boundary(frame, group);
  const double* of_others = group.coupled + group.boundary_stride;
  for (uint32_t i = 0; i < group.boundary_stride; ++i)
    state.outside[i] = group.exterior_force[i] - of_others[i];
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

// Forces that no tissue takes, as of a compliance that is positive definite in each group and not as a whole, are none.
void find_traction(ZoneFrame& frame, const ZoneGroup& group) {
  constexpr double kMostMoved =
      1e4;  // in units of what moves this node alone by the scene's largest displacement
  ZoneState& state = frame.state;
  const uint32_t stride = group.boundary_stride;
  double* t = state.vector;
  for (uint32_t i = 0; i < stride; ++i) t[i] = -group.coupled[stride + i];
  state.kernel.add_symmetric_product(group.whole, stride, state.boundary, t);
  bool sound = true;
  for (uint32_t i = 0; i < 3 * group.num_boundary; ++i) {
    const double own = group.whole[size_t{i} * stride + i];
    sound = sound && fabs(t[i]) <= kMostMoved * frame.pack.max_displacement * own;
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
