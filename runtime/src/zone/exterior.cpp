#include "runtime/src/zone/exterior.hpp"

#include <string.h>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_set.hpp"

namespace palpate {
namespace {

void clear_fixed_axes(const OrganView& organ, double* values) {
  for (uint32_t node = 0; node < organ.num_nodes; ++node) {
    const uint32_t axes = organ.nodes[node].free_axes;
    for (uint32_t axis = 0; axis < 3 && axes != 7; ++axis) {
      if ((axes >> axis & 1) == 0) values[size_t{3} * node + axis] = 0;
    }
  }
}

// The tangent of the exterior is that at the pressures of the last evaluation.
void follow_pressures_of(const ZoneBatches& batches) {
  for (uint32_t p = 0; p < batches.num_patches; ++p)
    batches.patches[p].followed = batches.patches[p].pressure;
}

}  // namespace

void carve_organ_state(const pal_pack& pack, Arena& arena, OrganState& state) {
  const size_t size = size_t{3} * pack.organ.num_nodes;
  state = {};
  state.rest_force = arena.take<double>(size);
  state.displacement = arena.take<double>(size);
  state.forces = arena.take<double>(size);
  state.extension = arena.take<double>(size);
}

void rest_organ(const pal_pack& pack, const OrganElements& elements, OrganState& state) {
  const OrganView& organ = pack.organ;
  const size_t bytes = size_t{3} * organ.num_nodes * sizeof(double);
  for (uint32_t node = 0; node < organ.num_nodes; ++node)
    memcpy(state.displacement + size_t{3} * node, organ.nodes[node].displacement, 3 * sizeof(double));
  memset(state.rest_force, 0, bytes);
  memset(state.forces, 0, bytes);
  add_zone_forces(elements.all, state.displacement, state.rest_force);
  follow_pressures_of(elements.all);
  state.energy = 0;
  state.smallest_jacobian = 1;
}

void extend_exterior(const pal_pack& pack, const Condensation& condensation, const EliminationKernel& kernel,
                     const double* zone, CondensationScratch& scratch, OrganState& state) {
  const uint32_t num_nodes = pack.organ.num_nodes;
  double* change = state.extension;
  for (uint32_t node = 0; node < num_nodes; ++node) {
    const bool is_outside = condensation.roles[node] == NodeRole::eliminated;
    for (size_t i = size_t{3} * node; i < size_t{3} * node + 3; ++i)
      change[i] = is_outside ? -state.forces[i] : zone[i] - state.displacement[i];
  }
  backward_substitute(condensation, kernel, scratch, change);
  for (size_t i = 0; i < size_t{3} * num_nodes; ++i) state.displacement[i] += change[i];
}

bool evaluate_organ(const pal_pack& pack, const OrganElements& elements, OrganState& state) {
  const OrganView& organ = pack.organ;
  const size_t size = size_t{3} * organ.num_nodes;
  for (size_t i = 0; i < size; ++i) state.forces[i] = -state.rest_force[i];
  const ZoneStrain strain = add_zone_forces(elements.all, state.displacement, state.forces);
  follow_pressures_of(elements.all);
  state.smallest_jacobian = strain.smallest_jacobian;
  state.energy = strain.energy;
  for (uint32_t node = 0; node < organ.num_nodes; ++node) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const size_t i = size_t{3} * node + axis;
      state.energy -= state.rest_force[i] * (state.displacement[i] - organ.nodes[node].displacement[axis]);
    }
  }
  clear_fixed_axes(organ, state.forces);
  return strain.smallest_jacobian > kLeastJacobian;
}

void condense_exterior(const Condensation& condensation, const EliminationKernel& kernel,
                       const double* zone_forces, CondensationScratch& scratch, OrganState& state) {
  for (uint32_t i = 0; i < condensation.num_kept; ++i) {
    for (uint32_t axis = 0; axis < 3; ++axis)
      state.forces[size_t{3} * condensation.kept[i] + axis] -= zone_forces[3 * i + axis];
  }
  forward_substitute(condensation, kernel, scratch, state.forces);
}

}  // namespace palpate
