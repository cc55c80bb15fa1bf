#include "runtime/src/zone/zone_mailbox.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>
#include <atomic>
#include <utility>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_balance.hpp"
#include "runtime/src/zone/zone_motion.hpp"

namespace palpate {
namespace {

bool is_in(const ZoneMailbox& mailbox, MailboxState expected) {
  const std::atomic_ref<uint32_t> state(const_cast<uint32_t&>(mailbox.state));
  return state.load(std::memory_order_acquire) == static_cast<uint32_t>(expected);
}

void pass_on(ZoneMailbox& mailbox, MailboxState next) {
  std::atomic_ref<uint32_t>(mailbox.state).store(static_cast<uint32_t>(next), std::memory_order_release);
}

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

// The largest length by which an axis differs; `then`: null for rest.
double farthest(const ZoneFrame& frame, const double* now, const double* then) {
  double largest = 0;
  for (uint32_t i = 0; i < frame.set.num_axes; ++i)
    largest = std::max(largest, length_of(frame, i, now[i] - (then != nullptr ? then[i] : 0)));
  return largest;
}

// The exterior's energy where the zone is, without the constant: by group. `has_new_tangent`: S is not that of the last
// evaluate_group().
void find_energies(ZoneFrame& frame, bool has_new_tangent, double* energies) {
  for (uint32_t g = 0; g < frame.set.num_groups; ++g) {
    ZoneGroup& group = frame.set.groups[g];
    if (has_new_tangent) {
      find_exterior_force(frame, group);
      find_coupling(frame, group);
    }
    find_outside(frame, group);
    energies[g] = outside_energy(frame, group);
  }
}

// Makes a change of the correction and counts the energy that it brings.
template <typename Change>
void change_correction(const pal_pack& pack, ZoneState& state, Change&& change) {
  ZoneSet& set = state.active;
  ZoneFrame frame = {pack, state, set, 0};
  double before[kMostZoneContacts] = {};
  double after[kMostZoneContacts] = {};
  find_energies(frame, false, before);
  const uint64_t tangent = set.correction.tangent;
  const double constant = set.correction.energy;
  change();
  find_energies(frame, set.correction.tangent != tangent, after);
  state.corrected_energy += set.correction.energy - constant;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    state.corrected_energy += after[g] - before[g];
    set.groups[g].stored_in_balance += after[g] - before[g];
  }
}

void take_correction(const pal_pack& pack, ZoneDelivery& delivery, ZoneState& state) {
  ZoneSet& set = state.active;
  ZoneCorrection& correction = set.correction;
  if (delivery.tangent != correction.tangent) {
    std::swap(state.exterior, delivery.exterior);
    use_exterior(state.exterior, set);
    correction.tangent = delivery.tangent;
  }
  correction.energy = delivery.energy;
  uint32_t b = 0;
  for_each_boundary(set, [&](uint32_t place) {
    const double* rest = pack.zone_nodes[set.nodes[place]].displacement;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      correction.force[3 * place + axis] = delivery.force[3 * b + axis];
      correction.displacement_then[3 * place + axis] = rest[axis] + delivery.moved[3 * b + axis];
    }
    ++b;
  });
}

// Whether the contacts of the set are nearer to rest, where c = 0 is right, than to these places.
bool is_nearer_to_rest(const ZoneFrame& frame, const double* places) {
  return farthest(frame, frame.set.followed, places) > farthest(frame, frame.set.followed, nullptr);
}

// Back to first order where the correction is from far away, or the lane finds no way on.
void drop_if_useless(const pal_pack& pack, ZoneState& state) {
  ZoneSet& set = state.active;
  ZoneCorrection& correction = set.correction;
  const ZoneFrame frame = {pack, state, set, 0};
  if (!correction.is_refined ||
      (correction.failures < kMostFailures && !is_nearer_to_rest(frame, correction.followed_then)))
    return;
  change_correction(pack, state, [&] {
    drop_correction(set);
    ZoneFrame of_set = {pack, state, set, 0};
    find_tractions_from_rest(of_set);
  });
  state.has_jumped = true;
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
  request.num_groups = set.num_groups;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneGroup& group = set.groups[g];
    request.groups[g] = {first_boundary(group), group.num_boundary, group.boundary_stride};
  }
  request.exterior_size = exterior_size(set);
}

Taken read_delivery(const pal_pack& pack, ZoneMailbox& mailbox, ZoneState& state) {
  ZoneSet& set = state.active;
  if (!is_in(mailbox, MailboxState::delivered)) return Taken::none;
  pass_on(mailbox, MailboxState::idle);
  const ZoneRequest& request = mailbox.request;
  ZoneDelivery& delivery = mailbox.delivery;
  ZoneCorrection& correction = set.correction;
  if (request.set != correction.number || request.restarts != correction.restarts) return Taken::rejected;
  const ZoneFrame frame = {pack, state, set, 0};
  const bool is_far = is_nearer_to_rest(frame, request.followed);
  for (double& change : correction.force_change) change = -1;
  if (!delivery.is_good) {
    correction.change = static_cast<double>(INFINITY);
    ++correction.failures;
  }
  if (!delivery.is_good || is_far) return Taken::rejected;
  change_correction(pack, state, [&] { take_correction(pack, delivery, state); });
  const bool is_of_this_tissue = request.inclusion_version == state.inclusion_version;
  state.has_jumped = state.has_jumped || !correction.is_refined || !isfinite(correction.change);
  correction.change = is_of_this_tissue ? delivery.change : static_cast<double>(INFINITY);
  correction.is_refined = true;
  correction.failures = 0;
  correction.field = mailbox.field;
  memcpy(correction.followed_then, request.followed, set.num_axes * sizeof *set.followed);
  return Taken::taken;
}

}  // namespace

void carve_mailbox(const pal_pack& pack, const ZoneState& state, Arena& arena, ZoneMailbox& mailbox) {
  mailbox = {};
  ZoneRequest& request = mailbox.request;
  request.nodes = arena.take<uint32_t>(state.max_nodes);
  request.displacement = arena.take<double>(size_t{3} * state.max_nodes);
  request.elements = arena.take<uint32_t>(state.max_elements);
  request.boundary = arena.take<uint32_t>(state.max_boundary);
  mailbox.delivery.force = arena.take<double>(size_t{3} * state.max_boundary);
  mailbox.delivery.moved = arena.take<double>(size_t{3} * state.max_boundary);
  mailbox.delivery.exterior = arena.take<double>(state.max_exterior);
  for (pal_real*& field : mailbox.fields)
    field = arena.take<pal_real>(size_t{pack::num_panels(pack.num_nodes)} * pack::kPanelRows);
}

Taken take_delivery(const pal_pack& pack, ZoneMailbox& mailbox, ZoneState& state) {
  const Taken taken = read_delivery(pack, mailbox, state);
  drop_if_useless(pack, state);
  return taken;
}

void post_request(const pal_pack& pack, uint32_t used, ZoneState& state, ZoneMailbox& mailbox) {
  constexpr double kConverged = 1e-12;
  ZoneSet& set = state.active;
  ZoneCorrection& correction = set.correction;
  if (!is_in(mailbox, MailboxState::idle) || !set.sound) return;
  const ZoneFrame frame = {pack, state, set, 0};
  const double size = farthest(frame, set.followed, nullptr);
  if (correction.is_refined && correction.change <= kConverged * size &&
      farthest(frame, set.followed, correction.followed_then) == 0)
    return;
  ZoneRequest& request = mailbox.request;
  if (request.set != correction.number) list_members(pack, set, request);
  request.set = correction.number;
  request.restarts = correction.restarts;
  request.tangent = correction.tangent;
  request.num_axes = set.num_axes;
  memcpy(request.followed, set.followed, set.num_axes * sizeof *set.followed);
  memcpy(request.displacement, set.displacement, size_t{3} * set.num_nodes * sizeof *set.displacement);
  request.inclusion = state.inclusion;
  request.inclusion_version = state.inclusion_version;
  if (correction.is_refined) used |= 1u << correction.field;
  mailbox.field = 0;
  while ((used >> mailbox.field & 1) != 0) ++mailbox.field;
  request.field = mailbox.fields[mailbox.field];
  pass_on(mailbox, MailboxState::requested);
}

}  // namespace palpate
