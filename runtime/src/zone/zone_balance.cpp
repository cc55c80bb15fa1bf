#include "runtime/src/zone/zone_balance.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/numerics/product.hpp"
#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

constexpr double kFarthest = 1e4;  // limit of a node's displacement over the scene's largest displacement

const double* rest_displacement(const ZoneFrame& frame, uint32_t place) {
  return node_at(frame.pack, frame.set, place).displacement;
}

// boundary, [boundary_stride], := w_B of the given displacements of the set's nodes.
void find_boundary(const ZoneFrame& frame, const ZoneGroup& group, const double* displacement,
                   double* boundary) {
  memset(boundary, 0, group.boundary_stride * sizeof *boundary);
  for (uint32_t b = 0; b < group.num_boundary; ++b) {
    const uint32_t place = first_boundary(group) + b;
    const double* rest = rest_displacement(frame, place);
    for (uint32_t axis = 0; axis < 3; ++axis)
      boundary[3 * b + axis] = displacement[3 * place + axis] - rest[axis];
  }
}

// change := d.
void find_change_since(const ZoneSet& set, double* change) {
  find_axes_change(set.num_contacts, set.num_axes, set.correction.followed_then, set.followed, change);
}

}  // namespace

bool evaluate_group(ZoneFrame& frame, ZoneGroup& group) {
  ZoneWork& work = frame.work;
  const double* u = frame.set.displacement;
  const double limit = kFarthest * frame.pack.max_displacement;
  const uint32_t end = group.first_node + group.num_nodes;
  for (uint32_t place = group.first_node; place < end; ++place) {
    const double* rest = rest_displacement(frame, place);
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const uint32_t i = 3 * place + axis;
      if (!(fabs(u[i] - rest[axis]) <= limit)) return false;
      work.forces[i] = -frame.set.rest_force[i];
    }
  }
  const ZoneStrain strain = add_zone_forces(group.batches, u, work.forces);
  group.energy = strain.energy;
  group.smallest_jacobian = strain.smallest_jacobian;
  if (!(strain.smallest_jacobian > kLeastJacobian)) return false;
  find_exterior_force(frame, group);
  return true;
}

void find_rest_force(const pal_pack& pack, double* rest, ZoneSet& set, const ZoneGroup& group) {
  const size_t first = size_t{3} * group.first_node;
  for (uint32_t i = 0; i < group.num_nodes; ++i)
    memcpy(rest + first + 3 * i, node_at(pack, set, group.first_node + i).displacement, 3 * sizeof *rest);
  memset(set.rest_force + first, 0, size_t{3} * group.num_nodes * sizeof *set.rest_force);
  add_zone_forces(group.batches, rest, set.rest_force);
  for (ZonePatch* patch = group.batches.patches; patch < group.batches.patches + group.batches.num_patches;
       ++patch)
    patch->at_rest = patch->pressure;
}

void find_exterior_force(ZoneFrame& frame, ZoneGroup& group) {
  ZoneWork& work = frame.work;
  find_boundary(frame, group, frame.set.displacement, work.boundary);
  memset(group.exterior.force, 0, group.boundary_stride * sizeof *group.exterior.force);
  frame.kernel.add_symmetric_product(group.exterior.stiffness, group.boundary_stride, work.boundary,
                                     group.exterior.force);
}

void find_coupling(ZoneFrame& frame) {
  ZoneSet& set = frame.set;
  if (set.num_groups <= 1) return;
  double change[kMostZoneAxes];
  find_change_since(set, change);
  for (ZoneGroup* group = set.groups; group < set.groups + set.num_groups; ++group) {
    memset(group->exterior.coupled, 0, group->boundary_stride * sizeof *group->exterior.coupled);
    for (uint32_t axis = 0; axis < set.num_axes; ++axis) {
      const double* column = group->exterior.coupling + size_t{axis} * group->boundary_stride;
      for (uint32_t i = 0; i < group->boundary_stride; ++i)
        group->exterior.coupled[i] += change[axis] * column[i];
    }
  }
}

double coupled_energy(const ZoneFrame& frame) {
  const ZoneSet& set = frame.set;
  if (set.num_groups <= 1) return 0;
  double change[kMostZoneAxes];
  find_change_since(set, change);
  double energy = 0;
  for (uint32_t i = 0; i < set.num_axes; ++i)
    energy -= change[i] * (set.correction.coupled_then[i] +
                           0.5 * product(set.coupled_stiffness[i], change, set.num_axes));
  return energy;
}

void find_axis_forces(ZoneFrame& frame, const double* displacement, double* forces) {
  const ZoneSet& set = frame.set;
  memset(forces, 0, set.num_axes * sizeof *forces);
  if (set.num_groups <= 1) return;
  for (const ZoneGroup* group = set.groups; group < set.groups + set.num_groups; ++group) {
    find_boundary(frame, *group, displacement, frame.work.vector);
    for (uint32_t axis = 0; axis < set.num_axes; ++axis)
      forces[axis] += product(group->exterior.coupling + size_t{axis} * group->boundary_stride,
                              frame.work.vector, group->boundary_stride);
  }
}

void find_coupled_force(ZoneFrame& frame) {
  ZoneSet& set = frame.set;
  find_axis_forces(frame, set.displacement, set.coupled_force);
  if (set.num_groups <= 1) return;
  double change[kMostZoneAxes];
  find_change_since(set, change);
  for (uint32_t i = 0; i < set.num_axes; ++i)
    set.coupled_force[i] -=
        set.correction.coupled_then[i] + product(set.coupled_stiffness[i], change, set.num_axes);
}

void find_outside(ZoneFrame& frame, const ZoneGroup& group) {
  ZoneWork& work = frame.work;
  find_boundary(frame, group, frame.set.displacement, work.boundary);
  for (uint32_t i = 0; i < group.boundary_stride; ++i)
    work.outside[i] = group.exterior.force[i] + group.exterior.coupled[i];
  const double* correction = frame.set.correction.force + size_t{3} * first_boundary(group);
  for (uint32_t i = 0; i < 3 * group.num_boundary; ++i) work.outside[i] += correction[i];
}

void find_residual(ZoneFrame& frame, const ZoneGroup& group) {
  ZoneWork& work = frame.work;
  const ZoneSet& set = frame.set;
  find_outside(frame, group);
  double* residual = work.residual;
  const uint32_t free = group.num_interior + group.num_boundary;
  const double* forces = work.forces + size_t{3} * group.first_node;
  memcpy(residual, forces, size_t{3} * free * sizeof *residual);
  for (uint32_t i = 0; i < 3 * group.num_boundary; ++i)
    residual[3 * group.num_interior + i] += work.outside[i];
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
      // d torque = (dt x a) x f = (a f^T - (a . f) I) dt, with a the arm and dt a rotation
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

double outside_energy(const ZoneFrame& frame, const ZoneGroup& group) {
  const double* correction = frame.set.correction.force + size_t{3} * first_boundary(group);
  double energy = 0;
  for (uint32_t i = 0; i < 3 * group.num_boundary; ++i)
    energy +=
        0.5 * frame.work.boundary[i] * (frame.work.outside[i] + correction[i] + group.exterior.coupled[i]);
  return energy;
}

double stored_energy(const ZoneFrame& frame, const ZoneGroup& group) {
  const ZoneSet& set = frame.set;
  double energy = group.energy + outside_energy(frame, group);
  for (uint32_t place = group.first_node; place < group.first_node + group.num_nodes; ++place) {
    const double* rest = rest_displacement(frame, place);
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const uint32_t i = 3 * place + axis;
      energy -= set.rest_force[i] * (set.displacement[i] - rest[axis]);
    }
  }
  return energy;
}

}  // namespace palpate
