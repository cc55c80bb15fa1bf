#include "runtime/src/exterior/exterior.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>
#include <utility>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

using Phase = ExteriorState::Phase;

constexpr double kLeastPart = 1.0 / 64;  // of a step, however many iterations fail

size_t num_values(const Exterior& exterior) {
  return size_t{3} * exterior.pack.organ.num_nodes;
}

// Gives the next tangent the pressures of the last evaluation.
void use_last_pressures(const ZoneBatches& batches) {
  for (uint32_t p = batches.first_patch; p < batches.first_patch + batches.num_patches; ++p)
    batches.patches[p].followed = batches.patches[p].pressure;
}

// Begins Phase::evaluate at ExteriorState::next.
void begin_evaluate_phase(const Exterior& exterior, ExteriorState& state) {
  for (size_t i = 0; i < num_values(exterior); ++i) state.next_forces[i] = -state.rest_force[i];
  state.strain = {0, static_cast<double>(INFINITY)};
  state.phase = Phase::evaluate;
  state.front = 0;
}

void end_extension(const Exterior& exterior, Acceleration& acceleration, ExteriorState& state) {
  for (size_t i = 0; i < num_values(exterior); ++i)
    state.next[i] = state.displacement[i] + state.part * state.next[i];
  if (state.part == 1) accelerate(state.displacement, state.next, acceleration);
  begin_evaluate_phase(exterior, state);
}

// Subtracts the rest energy and the work of the rest forces, and drops forces on fixed axes, which the
// supports take. Returns false if an element is inverted or nearly so.
bool end_evaluation(const Exterior& exterior, ExteriorState& state) {
  const OrganView& organ = exterior.pack.organ;
  for (uint32_t node = 0; node < organ.num_nodes; ++node) {
    const pack::OrganNode& entry = organ.nodes[node];
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const size_t i = size_t{3} * node + axis;
      state.strain.energy -= state.rest_force[i] * (state.next[i] - entry.displacement[axis]);
      if ((entry.free_axes >> axis & 1) == 0) state.next_forces[i] = 0;
    }
  }
  state.phase = Phase::condense;
  state.front = 0;
  state.strain.energy -= state.rest_energy;
  return state.strain.smallest_jacobian > kLeastJacobian && isfinite(state.strain.energy);
}

void end_iteration(const Exterior& exterior, ExteriorState& state) {
  use_last_pressures(exterior.elements.all);
  std::swap(state.displacement, state.next);
  std::swap(state.forces, state.next_forces);
  state.energy = state.strain.energy;
  state.part = std::min(1.0, 2 * state.part);
  state.phase = Phase::ended;
}

}  // namespace

uint64_t evaluate_front(const Exterior& exterior, uint32_t front, const double* displacement,
                        ZoneStrain& strain, double* forces) {
  const ZoneBatches batches = batches_of_front(exterior.elements, exterior.zone_of_simd_lane, 0, front);
  const ZoneStrain front_strain = add_zone_forces(batches, displacement, forces);
  strain.energy += front_strain.energy;
  strain.smallest_jacobian = std::min(strain.smallest_jacobian, front_strain.smallest_jacobian);
  return force_operations(batches);
}

void carve_exterior(const pal_pack& pack, Arena& arena, ExteriorState& state) {
  const size_t size = size_t{3} * pack.organ.num_nodes;
  state = {};
  for (double** values :
       {&state.rest_force, &state.displacement, &state.forces, &state.next, &state.next_forces})
    *values = arena.take<double>(size);
}

void rest_exterior(const Exterior& exterior, ExteriorState& state) {
  const OrganView& organ = exterior.pack.organ;
  const size_t bytes = num_values(exterior) * sizeof(double);
  for (uint32_t node = 0; node < organ.num_nodes; ++node)
    memcpy(state.displacement + size_t{3} * node, organ.nodes[node].displacement, 3 * sizeof(double));
  memset(state.rest_force, 0, bytes);
  memset(state.forces, 0, bytes);
  ZoneStrain strain = {0, static_cast<double>(INFINITY)};
  for (uint32_t f = 0; f < organ.num_fronts; ++f)
    evaluate_front(exterior, f, state.displacement, strain, state.rest_force);
  use_last_pressures(exterior.elements.all);
  const ZoneBatches& all = exterior.elements.all;
  for (uint32_t p = all.first_patch; p < all.first_patch + all.num_patches; ++p)
    all.patches[p].at_rest = all.patches[p].pressure;
  state.rest_energy = strain.energy;
  state.energy = 0;
  state.part = 1;
  state.phase = Phase::ended;
}

void begin_iteration(const Exterior& exterior, const Condensation& condensation, const double* zone,
                     ExteriorState& state) {
  const OrganView& organ = exterior.pack.organ;
  for (uint32_t node = 0; node < organ.num_nodes; ++node) {
    const bool is_outside = condensation.roles[node] == NodeRole::eliminated;
    for (size_t i = size_t{3} * node; i < size_t{3} * node + 3; ++i)
      state.next[i] = is_outside ? -state.forces[i] : zone[i] - state.displacement[i];
  }
  state.phase = Phase::extend;
  state.front = 0;
}

void begin_evaluation(const Exterior& exterior, ExteriorState& state) {
  memcpy(state.next, state.displacement, num_values(exterior) * sizeof *state.next);
  begin_evaluate_phase(exterior, state);
}

Progress advance_iteration(const Exterior& exterior, const Condensation& condensation, uint64_t operations,
                           CondensationScratch& scratch, Acceleration& acceleration, ExteriorState& state,
                           uint64_t& spent) {
  const uint32_t num_fronts = exterior.pack.organ.num_fronts;
  while (state.phase != Phase::ended) {
    if (spent >= operations) return Progress::goes_on;
    if (state.front == num_fronts) {
      switch (state.phase) {
        case Phase::extend:
          end_extension(exterior, acceleration, state);
          break;
        case Phase::evaluate:
          if (!end_evaluation(exterior, state)) {
            state.phase = Phase::ended;
            state.part = std::max(kLeastPart, 0.5 * state.part);
            restart_acceleration(acceleration);
            return Progress::failed;
          }
          break;
        default:
          end_iteration(exterior, state);
      }
      continue;
    }
    const uint32_t front = state.front++;
    switch (state.phase) {
      case Phase::extend:
        spent += backward_substitute_front(condensation, exterior.kernel, num_fronts - 1 - front, scratch,
                                           state.next);
        break;
      case Phase::evaluate:
        spent += evaluate_front(exterior, front, state.next, state.strain, state.next_forces);
        break;
      default:
        spent += forward_substitute_front(condensation, exterior.kernel, front, scratch, state.next_forces);
    }
  }
  return Progress::ended;
}

}  // namespace palpate
