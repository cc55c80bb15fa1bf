#include "runtime/src/zone/zone_mailbox.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>
#include <atomic>
#include <utility>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_motion.hpp"

namespace palpate {
namespace {

// Returns the largest difference of an axis, a length. `then`: null for rest.
double largest_axis_change(const ZoneFrame& frame, const double* now, const double* then) {
  double largest = 0;
  for (uint32_t i = 0; i < frame.set.num_axes; ++i)
    largest = std::max(largest, length_of(frame, i, now[i] - (then != nullptr ? then[i] : 0)));
  return largest;
}

// Returns the exterior's energy E at the current state. `energies`: [groups] outside_energy().
double find_energies(ZoneFrame& frame, double* energies) {
  double sum = frame.set.correction.energy + coupled_energy(frame);
  for (uint32_t g = 0; g < frame.set.num_groups; ++g) {
    find_outside(frame, frame.set.groups[g]);
    energies[g] = outside_energy(frame, frame.set.groups[g]);
    sum += energies[g];
  }
  return sum;
}

// Changes the correction, and adds the resulting change of energy to ZoneState::corrected_energy.
template <typename Change>
void change_correction(const pal_pack& pack, ZoneState& state, Change&& change) {
  ZoneSet& set = state.active;
  ZoneFrame frame = frame_of(pack, state);
  double before[kMostZoneContacts] = {};
  double after[kMostZoneContacts] = {};
  // A last step is not evaluated, so S w_B may be from before the step.
  for (uint32_t g = 0; g < set.num_groups; ++g) find_exterior_force(frame, set.groups[g]);
  const double sum = find_energies(frame, before);
  const uint64_t tangent = set.correction.tangent;
  const auto move_balance = [&](double sign) {
    for (ZoneGroup* group = set.groups; group < set.groups + set.num_groups; ++group) {
      for (uint32_t i = 0; i < group->boundary_stride; ++i)
        group->exterior.coupled_in_balance[i] += sign * group->exterior.coupled[i];
    }
  };
  move_balance(-1);
  change(frame);
  find_coupling(frame);
  move_balance(1);
  for (uint32_t g = 0; g < set.num_groups && set.correction.tangent != tangent; ++g)
    find_exterior_force(frame, set.groups[g]);
  state.corrected_energy += find_energies(frame, after) - sum;
  for (uint32_t g = 0; g < set.num_groups; ++g) set.groups[g].stored_in_balance += after[g] - before[g];
}

// Whether the contacts are nearer to rest, where c = 0 is exact, than to other axes, [num_axes].
bool is_nearer_to_rest(const ZoneFrame& frame, const double* axes) {
  return largest_axis_change(frame, frame.set.followed, axes) >
         largest_axis_change(frame, frame.set.followed, nullptr);
}

// Drops the correction if its state is farther away than rest, or after kMostFailures failed iterations.
void drop_if_useless(const pal_pack& pack, ZoneState& state) {
  ZoneSet& set = state.active;
  ZoneCorrection& correction = set.correction;
  const ZoneFrame frame = frame_of(pack, state);
  if (!correction.is_refined || !has_exterior(set) ||
      (correction.failures < kMostFailures && !is_nearer_to_rest(frame, correction.followed_then)))
    return;
  change_correction(pack, state, [&](ZoneFrame&) { drop_correction(set); });
  state.has_jumped = true;
}

// Makes the set use S of the delivery.
void take_exterior(ZoneDelivery& delivery, ZoneState& state) {
  ZoneCorrection& correction = state.active.correction;
  if (delivery.tangent == correction.tangent) return;
  std::swap(state.exterior, delivery.exterior);
  use_exterior(state.exterior, state.active);
  correction.tangent = delivery.tangent;
}

Taken read_delivery(const pal_pack& pack, ZoneMailbox& mailbox, ZoneState& state) {
  ZoneSet& set = state.active;
  if (!is_in(mailbox, MailboxState::delivered) || mailbox.request.kind != ZoneRequest::Kind::iterate)
    return Taken::none;
  set_state(mailbox, MailboxState::idle);
  const ZoneRequest& request = mailbox.request;
  ZoneDelivery& delivery = mailbox.delivery;
  ZoneCorrection& correction = set.correction;
  if (request.set != correction.number || request.restarts != correction.restarts) return Taken::rejected;
  const ZoneFrame frame = frame_of(pack, state);
  const bool is_far = is_nearer_to_rest(frame, request.followed);
  for (double& change : correction.force_change) change = -1;
  if (!delivery.is_good) {
    correction.change = static_cast<double>(INFINITY);
    ++correction.failures;
  }
  if (!delivery.is_good || is_far) return Taken::rejected;
  const bool begins = has_exterior(set) && (!correction.is_refined || !isfinite(correction.change));
  state.has_jumped = state.has_jumped || begins;
  change_correction(pack, state, [&](ZoneFrame& now) {
    take_exterior(delivery, state);
    take_correction(mailbox, request.followed, request.displacement, now);
  });
  if (delivery.has_tangents) {
    std::swap(state.tangents, delivery.tangents);
    use_tangents(state.tangents, delivery.made, set);
  }
  const bool is_of_this_tissue = request.inclusion_version == state.inclusion_version;
  correction.change = is_of_this_tissue ? delivery.change : static_cast<double>(INFINITY);
  return Taken::taken;
}

// Writes the state of the active set to the request, and chooses an unused field for the delivery.
void fill_request(uint32_t used, const ZoneState& state, ZoneMailbox& mailbox) {
  const ZoneSet& set = state.active;
  const ZoneCorrection& correction = set.correction;
  ZoneRequest& request = mailbox.request;
  request.set = correction.number;
  request.restarts = correction.restarts;
  request.tangent = correction.tangent;
  request.is_strained = set.ready && state.strained;
  request.num_axes = set.num_axes;
  memcpy(request.followed, set.followed, set.num_axes * sizeof *set.followed);
  memcpy(request.displacement, set.displacement, size_t{3} * set.num_nodes * sizeof *set.displacement);
  memcpy(request.masters, set.masters, set.num_masters * sizeof *set.masters);
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    set.groups[g].tangent.moved_since = 0;
    set.groups[g].tangent.age_since = 0;
  }
  request.inclusion = state.inclusion;
  request.inclusion_version = state.inclusion_version;
  used |= 1u << correction.field | 1u << correction.rest_field;
  mailbox.field = 0;
  while ((used >> mailbox.field & 1) != 0) ++mailbox.field;
  request.field = mailbox.fields[mailbox.field];
}

}  // namespace

size_t field_size(const pal_pack& pack) {
  return size_t{pack::num_panels(pack.num_nodes)} * pack::kPanelRows;
}

void carve_mailbox(const pal_pack& pack, const ZoneRoom& room, Arena& arena, ZoneMailbox& mailbox) {
  mailbox = {};
  mailbox.request.displacement = arena.take<double>(size_t{3} * room.nodes);
  mailbox.request.masters = arena.take<ZoneMaster>(room.masters);
  mailbox.delivery.tangents = carve_tangents(room, arena);
  const size_t axes = room.axes_per_contact * room.contacts;
  mailbox.delivery.force = arena.take<double>(symmetric_stride(3 * room.boundary));
  mailbox.delivery.exterior = arena.take<float>(room.exterior);
  for (pal_real*& field : mailbox.fields) field = arena.take<pal_real>((1 + axes) * field_size(pack));
}

bool is_in(const ZoneMailbox& mailbox, MailboxState expected) {
  const std::atomic_ref<uint32_t> state(const_cast<uint32_t&>(mailbox.state));
  return state.load(std::memory_order_acquire) == static_cast<uint32_t>(expected);
}

void set_state(ZoneMailbox& mailbox, MailboxState next) {
  std::atomic_ref<uint32_t>(mailbox.state).store(static_cast<uint32_t>(next), std::memory_order_release);
}

bool take_prepared(ZoneMailbox& mailbox) {
  if (!is_in(mailbox, MailboxState::delivered) || mailbox.request.kind != ZoneRequest::Kind::prepare)
    return false;
  set_state(mailbox, MailboxState::idle);
  return true;
}

void take_correction(const ZoneMailbox& mailbox, const double* followed, const double* displacement,
                     ZoneFrame& frame) {
  const ZoneSet& set = frame.set;
  ZoneCorrection& correction = frame.set.correction;
  const ZoneDelivery& delivery = mailbox.delivery;
  size_t taken = 0;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneGroup& group = set.groups[g];
    const size_t first = size_t{3} * first_boundary(group);
    const size_t count = size_t{3} * group.num_boundary;
    memcpy(correction.force + first, delivery.force + taken, count * sizeof *delivery.force);
    taken += count;
  }
  correction.energy = delivery.energy;
  correction.is_refined = true;
  correction.is_unstable = delivery.is_unstable;
  correction.failures = 0;
  correction.field = mailbox.field;
  memcpy(correction.followed_then, followed, set.num_axes * sizeof *followed);
  find_axis_forces(frame, displacement, correction.coupled_then);
}

Taken take_delivery(const pal_pack& pack, ZoneMailbox& mailbox, ZoneState& state) {
  const Taken taken = read_delivery(pack, mailbox, state);
  drop_if_useless(pack, state);
  return taken;
}

void request_iteration(const pal_pack& pack, uint32_t used, ZoneState& state, ZoneMailbox& mailbox) {
  constexpr double kConverged = 1e-12;
  const ZoneSet& set = state.active;
  const ZoneCorrection& correction = set.correction;
  if (!is_in(mailbox, MailboxState::idle) || !set.sound) return;
  const ZoneFrame frame = frame_of(pack, state);
  const double size = largest_axis_change(frame, set.followed, nullptr);
  if (correction.is_refined && correction.change <= kConverged * size &&
      largest_axis_change(frame, set.followed, correction.followed_then) == 0)
    return;
  mailbox.request.kind = ZoneRequest::Kind::iterate;
  fill_request(used, state, mailbox);
  set_state(mailbox, MailboxState::requested);
}

void request_set(uint32_t used, ZoneState& state, ZoneMailbox& mailbox) {
  mailbox.request.kind = ZoneRequest::Kind::prepare;
  fill_request(used, state, mailbox);
  mailbox.request.next_set = ++mailbox.num_sets;
  set_state(mailbox, MailboxState::requested);
}

}  // namespace palpate
