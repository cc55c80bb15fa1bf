#include "runtime/src/zone/zone_inclusion.hpp"

#include <math.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_balance.hpp"

namespace palpate {
namespace {

// Returns s(X) of zone_inclusion.hpp.
double factor_at(const pal_pack& pack, const Inclusion& inclusion, const double point[3]) {
  double square = 0;
  for (int i = 0; i < 3; ++i) {
    const double offset = point[i] - inclusion.centre[i];
    square += offset * offset;
  }
  const double outside = (sqrt(square) - inclusion.radius) / pack.mean_surface_edge + 0.5;
  const double t = std::min(1.0, std::max(0.0, 1.0 - outside));
  return 1.0 + (inclusion.stiffness - 1.0) * t * t * (3.0 - 2.0 * t);
}

// Returns s(X_e) of the element in a SIMD lane. `nodes` maps places of the batch to nodes; null: identity.
double element_factor(const pal_pack& pack, const Inclusion& inclusion, const uint32_t* nodes,
                      const std::array<int, kLanes>* corners, int lane) {
  if (!inclusion.is_present) return 1;
  double centre[3] = {};
  for (size_t corner = 0; corner < 4; ++corner) {
    const auto place = static_cast<uint32_t>(corners[corner][static_cast<size_t>(lane)]);
    const pack::OrganNode& node = pack.organ.nodes[nodes != nullptr ? nodes[place] : place];
    for (int i = 0; i < 3; ++i) centre[i] += 0.25 * (node.position[i] + node.displacement[i]);
  }
  return factor_at(pack, inclusion, centre);
}

// Returns the largest change of s over elements, relative to the larger of old and new s.
double largest_change(const pal_pack& pack, const Inclusion& inclusion, const uint32_t* nodes,
                      const ZoneBatches& batches) {
  double largest = 0;
  for_each_lanes(batches, [&](const ZoneLanes& lanes, const std::array<int, kLanes>* corners) {
    for (int lane = 0; lane < lanes.count; ++lane) {
      const double s = element_factor(pack, inclusion, nodes, corners, lane);
      largest = std::max(largest, fabs(s - lanes.stiffness[lane]) / std::max(s, lanes.stiffness[lane]));
    }
  });
  return largest;
}

void set_stiffness(const pal_pack& pack, const Inclusion& inclusion, const uint32_t* nodes,
                   const ZoneBatches& batches) {
  for_each_lanes(batches, [&](ZoneLanes& lanes, const std::array<int, kLanes>* corners) {
    for (int lane = 0; lane < kLanes; ++lane)
      lanes.stiffness[lane] = element_factor(pack, inclusion, nodes, corners, lane);
  });
  scale_volumes(batches);
}

// Returns the energy of a group's elements beyond the work of their forces at rest.
double element_energy(const ZoneSet& set, const ZoneGroup& group, const pal_pack& pack, double* scratch) {
  double energy = add_zone_forces(group.batches, set.displacement, scratch).energy;
  for (uint32_t place = group.first_node; place < group.first_node + group.num_nodes; ++place) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const uint32_t i = 3 * place + axis;
      energy -= set.rest_force[i] * (set.displacement[i] - node_at(pack, set, place).displacement[axis]);
    }
  }
  return energy;
}

}  // namespace

void take_inclusion(const pal_pack& pack, ZoneState& state) {
  ZoneSet& set = state.active;
  if (set.inclusion_version == state.inclusion_version) return;
  // A new set has the inclusion from the start, so the inclusion adds no energy to the set.
  const bool is_new = set.inclusion_version == kNoInclusion;
  if (is_new) state.inclusion_energy = 0;
  set.inclusion_version = state.inclusion_version;
  // The correction stays until a delivery includes the new tissue.
  set.correction.change = static_cast<double>(INFINITY);
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    ZoneGroup& group = set.groups[g];
    ZoneBatches& batches = group.batches;
    const double change = largest_change(pack, state.inclusion, set.nodes, batches);
    if (change == 0) continue;
    const double before = is_new ? 0 : element_energy(set, group, pack, state.work.forces);
    set_stiffness(pack, state.inclusion, set.nodes, batches);
    find_rest_force(pack, state.work.saved, set, group);
    group.has_balance = false;
    group.setbacks.retry_distance = 0;
    if (is_new) continue;
    // ZoneTangent::moved counts a relative change of stiffness as a motion by the same part of a mean edge.
    group.tangent.moved += change * pack.mean_surface_edge;
    group.tangent.moved_since += change * pack.mean_surface_edge;
    state.inclusion_energy += element_energy(set, group, pack, state.work.forces) - before;
  }
}

void set_organ_stiffness(const pal_pack& pack, const Inclusion& inclusion, const OrganElements& elements) {
  set_stiffness(pack, inclusion, nullptr, elements.all);
}

}  // namespace palpate
