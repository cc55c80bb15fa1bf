#include "runtime/src/zone/zone_inclusion.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

// s, of the file's comment.
double stiffness_at(const pal_pack& pack, const Inclusion& inclusion, const double point[3]) {
  double square = 0;
  for (int i = 0; i < 3; ++i) {
    const double offset = point[i] - inclusion.centre[i];
    square += offset * offset;
  }
  const double outside = (sqrt(square) - inclusion.radius) / pack.mean_surface_edge + 0.5;
  const double t = std::min(1.0, std::max(0.0, 1.0 - outside));
  return 1.0 + (inclusion.stiffness - 1.0) * t * t * (3.0 - 2.0 * t);
}

// Of a lane's element. `nodes`: of the organ, at the places of the batches; null: the places are nodes of the organ.
double stiffness_of(const pal_pack& pack, const Inclusion& inclusion, const uint32_t* nodes,
                    const std::array<int, kLanes>* corners, int lane) {
  if (!inclusion.is_present) return 1;
  double centre[3] = {};
  for (size_t corner = 0; corner < 4; ++corner) {
    const auto place = static_cast<uint32_t>(corners[corner][static_cast<size_t>(lane)]);
    const pack::OrganNode& node = pack.organ.nodes[nodes != nullptr ? nodes[place] : place];
    for (int i = 0; i < 3; ++i) centre[i] += 0.25 * (node.position[i] + node.displacement[i]);
  }
  return stiffness_at(pack, inclusion, centre);
}

// The largest change of a stiffness, of the larger.
double change_of(const pal_pack& pack, const Inclusion& inclusion, const uint32_t* nodes,
                 const ZoneBatches& batches) {
  double largest = 0;
  for_each_lanes(batches, [&](const ZoneLanes& lanes, const std::array<int, kLanes>* corners) {
    for (int lane = 0; lane < lanes.count; ++lane) {
      const double to = stiffness_of(pack, inclusion, nodes, corners, lane);
      largest = std::max(largest, fabs(to - lanes.stiffness[lane]) / std::max(to, lanes.stiffness[lane]));
    }
  });
  return largest;
}

void set_stiffness(const pal_pack& pack, const Inclusion& inclusion, const uint32_t* nodes,
                   const ZoneBatches& batches) {
  for_each_lanes(batches, [&](ZoneLanes& lanes, const std::array<int, kLanes>* corners) {
    for (int lane = 0; lane < kLanes; ++lane)
      lanes.stiffness[lane] = stiffness_of(pack, inclusion, nodes, corners, lane);
  });
  scale_volumes(batches);
}

// What a group's elements store beyond the work of their forces at rest.
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

void find_rest_force(const pal_pack& pack, ZoneState& state, const ZoneGroup& group) {
  ZoneSet& set = state.active;
  const size_t first = size_t{3} * group.first_node;
  memset(set.rest_force + first, 0, size_t{3} * group.num_nodes * sizeof(double));
  for (uint32_t place = group.first_node; place < group.first_node + group.num_nodes; ++place)
    memcpy(state.work.saved + size_t{3} * place, node_at(pack, set, place).displacement, 3 * sizeof(double));
  add_zone_forces(group.batches, state.work.saved, set.rest_force);
}

}  // namespace

void take_inclusion(const pal_pack& pack, ZoneState& state) {
  ZoneSet& set = state.active;
  if (set.inclusion_version == state.inclusion_version) return;
  // What a set that was just made has of it, it has from the start.
  const bool is_new = set.inclusion_version == kNoInclusion;
  if (is_new) state.inclusion_energy = 0;
  set.inclusion_version = state.inclusion_version;
  // The correction stays until a delivery knows of the new tissue.
  set.correction.change = static_cast<double>(INFINITY);
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    ZoneGroup& group = set.groups[g];
    ZoneBatches& batches = group.batches;
    const double change = change_of(pack, state.inclusion, set.nodes, batches);
    if (change == 0) continue;
    const double before = is_new ? 0 : element_energy(set, group, pack, state.work.forces);
    set_stiffness(pack, state.inclusion, set.nodes, batches);
    find_rest_force(pack, state, group);
    for (uint32_t p = 0; p < batches.num_patches; ++p)
      batches.patches[p].at_rest = batches.patches[p].pressure;
    group.has_balance = false;
    group.setbacks.elsewhere = 0;
    if (is_new) continue;
    // A tangent of other tissue is as far off as one of tissue that has been strained as much.
    group.tangent.moved += change * pack.mean_surface_edge;
    group.tangent.moved_since += change * pack.mean_surface_edge;
    state.inclusion_energy += element_energy(set, group, pack, state.work.forces) - before;
  }
}

void set_organ_stiffness(const pal_pack& pack, const Inclusion& inclusion, const OrganElements& elements) {
  set_stiffness(pack, inclusion, nullptr, elements.all);
}

}  // namespace palpate
