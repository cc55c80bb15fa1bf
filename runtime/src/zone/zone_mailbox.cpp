#include "runtime/src/zone/zone_mailbox.hpp"

#include <math.h>
#include <string.h>

#include <atomic>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_balance.hpp"

namespace palpate {
namespace {

// Calls visit(place) for the boundary's nodes that move, group by group.
template <typename Visit>
void for_each_boundary(const ZoneSet& set, Visit&& visit) {
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const uint32_t first = first_boundary(set.groups[g]);
    for (uint32_t place = first; place < first + set.groups[g].num_boundary; ++place) {
      if (set.unknown_of[place] != kNoUnknown) visit(place);
    }
  }
}

// Lists what the request names for as long as the set is the same.
void list_members(const pal_pack& pack, const ZoneSet& set, ZoneRequest& request) {
  request.num_nodes = set.num_nodes;
  for (uint32_t i = 0; i < set.num_nodes; ++i) request.nodes[i] = pack.organ.of_zone_node[set.nodes[i]];
  request.num_elements = set.num_elements;
  for (uint32_t e = 0; e < set.num_elements; ++e)
    request.elements[e] = pack.organ.of_zone_element[set.elements[e]];
  request.num_boundary = 0;
  for_each_boundary(set, [&](uint32_t place) { request.boundary[request.num_boundary++] = place; });
  // The contact nodes are the first nodes of the organ.
  request.num_fixed = set.num_fixed;
  memcpy(request.fixed, set.fixed, set.num_fixed * sizeof *set.fixed);
}

}  // namespace

void carve_mailbox(const pal_pack& pack, const ZoneState& state, Arena& arena, ZoneMailbox& mailbox) {
  mailbox = {};
  ZoneRequest& request = mailbox.request;
  request.nodes = arena.take<uint32_t>(state.max_nodes);
  request.displacement = arena.take<double>(size_t{3} * state.max_nodes);
  request.elements = arena.take<uint32_t>(state.max_elements);
  request.boundary = arena.take<uint32_t>(state.max_boundary);
  request.outside = arena.take<double>(size_t{3} * state.max_boundary);
  mailbox.delivery.outside = arena.take<double>(size_t{3} * state.max_boundary);
  for (pal_real*& field : mailbox.fields)
    field = arena.take<pal_real>(size_t{pack::num_panels(pack.num_nodes)} * pack::kPanelRows);
}

bool take_delivery(const pal_pack& pack, ZoneMailbox& mailbox, ZoneState& state, double& energy_corrected) {
  energy_corrected = 0;
  const std::atomic_ref<uint32_t> turn(mailbox.turn);
  const ZoneRequest& request = mailbox.request;
  if (turn.load(std::memory_order_acquire) != static_cast<uint32_t>(LaneTurn::haptic) || request.set == 0)
    return false;
  const ZoneDelivery& delivery = mailbox.delivery;
  ZoneSet& set = state.active;
  const bool is_taken = delivery.is_good && set.ready && request.set == set.number &&
                        request.restarts == set.restarts &&
                        request.inclusion_version == state.inclusion_version;
  ++(is_taken ? mailbox.deliveries : mailbox.rejected);
  if (!is_taken) return true;
  energy_corrected = delivery.energy - request.energy;
  uint32_t b = 0;
  for_each_boundary(set, [&](uint32_t place) {
    const double* rest = pack.zone_nodes[set.nodes[place]].displacement;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const double change = delivery.outside[3 * b + axis] - request.outside[3 * b + axis];
      const double* then = request.displacement + size_t{3} * place;
      const double* now = set.displacement + size_t{3} * place;
      set.correction[3 * place + axis] += change;
      set.corrected_energy -= change * (then[axis] - rest[axis]);
      energy_corrected += change * (now[axis] - then[axis]);
    }
    ++b;
  });
  set.corrected_energy += delivery.energy - request.energy;
  memcpy(set.traction_then, set.traction_posted, size_t{3} * set.num_nodes * sizeof *set.traction);
  set.field = mailbox.field;
  set.refined_change = delivery.change;
  set.is_refined = true;
  return true;
}

void post_request(const pal_pack& pack, uint32_t used, ZoneState& state, ZoneMailbox& mailbox) {
  const std::atomic_ref<uint32_t> turn(mailbox.turn);
  ZoneSet& set = state.active;
  if (turn.load(std::memory_order_acquire) != static_cast<uint32_t>(LaneTurn::haptic) || !set.sound) return;
  ZoneRequest& request = mailbox.request;
  ZoneFrame frame = {pack, state, set, 0};
  double energy = set.corrected_energy;
  uint32_t b = 0;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    ZoneGroup& group = set.groups[g];
    if (!evaluate_group(frame, group)) return;
    find_pull(frame, group);
    find_residual(frame, group);
    energy += outside_energy(frame, group);
    for (uint32_t i = 0; i < group.num_boundary; ++i) {
      if (set.unknown_of[first_boundary(group) + i] == kNoUnknown) continue;
      memcpy(request.outside + size_t{3} * b++, state.outside + size_t{3} * i, 3 * sizeof *state.outside);
    }
  }
  if (!isfinite(energy)) return;
  if (request.set != set.number) list_members(pack, set, request);
  request.set = set.number;
  request.restarts = set.restarts;
  request.energy = energy;
  request.num_axes = set.num_axes;
  memcpy(request.followed, set.followed, set.num_axes * sizeof *set.followed);
  memcpy(request.displacement, set.displacement, size_t{3} * set.num_nodes * sizeof *set.displacement);
  memcpy(set.traction_posted, set.traction, size_t{3} * set.num_nodes * sizeof *set.traction);
  request.inclusion = state.inclusion;
  request.inclusion_version = state.inclusion_version;
  if (set.is_refined) used |= 1u << set.field;
  mailbox.field = 0;
  while ((used >> mailbox.field & 1) != 0) ++mailbox.field;
  request.field = mailbox.fields[mailbox.field];
  turn.store(static_cast<uint32_t>(LaneTurn::refining), std::memory_order_release);
}

}  // namespace palpate
