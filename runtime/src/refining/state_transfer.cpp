#include "runtime/src/refining/state_transfer.hpp"

#include <math.h>
#include <string.h>

#include <utility>

#include "runtime/src/pack/contact_place.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_motion.hpp"

namespace palpate {
namespace {

// Whether a contact may have slid between two points at rest: they are at most kFarthest apart.
bool has_slid(const pal_pack& pack, const double from[3], const double to[3]) {
  constexpr double kFarthest = 1;  // mean edges of the surface
  double square = 0;
  for (int i = 0; i < 3; ++i) square += (to[i] - from[i]) * (to[i] - from[i]);
  return square <= kFarthest * kFarthest * pack.mean_surface_edge * pack.mean_surface_edge;
}

// Copies force and rotation of contacts that stay, and the rotation of contacts that slide. Clears the rest.
void carry_contacts(const pal_pack& pack, const ZoneSet& before, ZoneSet& set) {
  memset(set.force, 0, set.num_axes * sizeof *set.force);
  memset(set.followed, 0, set.num_axes * sizeof *set.followed);
  for (uint32_t c = 0; c < set.num_contacts && before.ready; ++c) {
    uint32_t old = 0;
    while (old < before.num_contacts && before.sites[old] != set.sites[c]) ++old;
    if (old < before.num_contacts) {
      memcpy(set.force + size_t{3} * c, before.force + size_t{3} * old, 3 * sizeof *set.force);
    } else if (set.num_contacts == before.num_contacts && has_slid(pack, before.points[c], set.points[c])) {
      old = c;
    }
    if (old == before.num_contacts || set.num_axes == 3 * set.num_contacts) continue;
    memcpy(set.followed + size_t{3} * (set.num_contacts + c),
           before.followed + size_t{3} * (before.num_contacts + old), 3 * sizeof *set.followed);
  }
}

// Calls visit(contact, place of the node, whether the patch turns) for each node that a contact holds.
template <typename Visit>
void for_each_held(const ZoneSet& set, Visit&& visit) {
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneGroup& group = set.groups[g];
    const uint32_t first = first_boundary(group) + group.num_boundary;
    for (uint32_t place = first; place < first + group.num_held; ++place) {
      for (uint32_t m = set.first_master[place]; m < set.first_master[place + 1]; ++m) {
        const ZoneMaster& master = set.masters[m];
        visit(group.contacts[(master.unknown - group.unknowns) / 3], place, master.turn != kNoUnknown);
      }
    }
  }
}

// Sets each patch's displacement: the mean over its nodes, without the part due to its rotation.
void find_patch_displacements(const pal_pack& pack, ZoneSet& set) {
  double held[kMostZoneContacts] = {};
  memset(set.followed, 0, size_t{3} * set.num_contacts * sizeof *set.followed);
  for_each_held(set, [&](uint32_t contact, uint32_t place, bool turns) {
    held[contact] += 1;
    double turn[3] = {};
    if (turns) {
      double arm[3];
      rest_arm(pack, set, contact, set.nodes[place], arm);
      rotate(patch_rotation(set, contact), arm, turn);
      for (int axis = 0; axis < 3; ++axis) turn[axis] -= arm[axis];
    }
    const double* rest = node_at(pack, set, place).displacement;
    for (uint32_t axis = 0; axis < 3; ++axis)
      set.followed[3 * contact + axis] += set.displacement[3 * place + axis] - rest[axis] - turn[axis];
  });
  for (uint32_t c = 0; c < set.num_contacts; ++c) {
    for (uint32_t axis = 0; axis < 3 && held[c] > 0; ++axis) set.followed[3 * c + axis] /= held[c];
  }
  memcpy(set.wanted, set.followed, set.num_axes * sizeof *set.wanted);
}

// Stores each group's first state. Puts groups with inverted elements at rest, and returns false then.
bool begin_groups(const pal_pack& pack, ZoneWork& work, ZoneSet& set) {
  bool none_inverted = true;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    ZoneGroup& group = set.groups[g];
    const ZoneStrain strain = add_zone_forces(group.batches, set.displacement, work.forces);
    group.setbacks.longest_step = kLongestStep;
    keep_balance(set, group);
    group.has_balance = false;
    if (strain.smallest_jacobian > kLeastJacobian) continue;
    rest_group(pack, set, group);
    none_inverted = false;
  }
  return none_inverted;
}

}  // namespace

void name_contacts(const pal_pack& pack, const pal_contact* contacts, uint32_t count, const FixedNodes& fixed,
                   const ZoneSet& before, ZonePreparation& preparation) {
  ZoneSet& set = preparation.set;
  set.ready = false;
  set.sound = true;
  set.num_contacts = count;
  set.num_axes = preparation.room.axes_per_contact * count;
  for (uint32_t c = 0; c < count; ++c) set.sites[c] = nearest_site(contacts[c]);
  find_places(pack, contacts, set);
  memcpy(set.points, set.places, count * sizeof *set.points);
  set.num_fixed = fixed.count;
  memcpy(set.fixed, fixed.nodes, fixed.count * sizeof *set.fixed);
  set.fixed_version = fixed.version;
  set.flags = 0;
  set.inclusion_version = kNoInclusion;
  memset(set.stiffness, 0, set.num_axes * sizeof *set.stiffness);
  memset(set.turning, 0, count * sizeof *set.turning);
  carry_contacts(pack, before, set);
}

bool place_set(const pal_pack& pack, const double* displacement, ZonePreparation& preparation) {
  ZoneSet& set = preparation.set;
  for (uint32_t i = 0; i < set.num_nodes; ++i) {
    const double* from = moving_axes(pack, set, i) != 0 ? displacement + size_t{3} * set.nodes[i]
                                                        : node_at(pack, set, i).displacement;
    memcpy(set.displacement + size_t{3} * i, from, 3 * sizeof *from);
  }
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneBatches& batches = set.groups[g].batches;
    add_zone_forces(batches, set.displacement, preparation.work.forces);
    for (ZonePatch* patch = batches.patches; patch < batches.patches + batches.num_patches; ++patch)
      patch->followed = patch->pressure;
  }
  find_patch_displacements(pack, set);
  set.correction.tangent = set.correction.rest_tangent;  // begin_groups() may call drop_correction()
  return begin_groups(pack, preparation.work, set);
}

void exchange_sets(const pal_pack& pack, ZoneMailbox& mailbox, ZonePreparation& preparation,
                   ZoneState& state) {
  ZoneSet& set = preparation.set;
  ZoneFrame frame = {pack, state.kernel, state.work, set, 0};
  const ZoneRequest& request = mailbox.request;
  const bool is_strained_now = state.active.ready && state.strained;
  ZoneCorrection& correction = set.correction;
  correction.number = request.next_set;
  correction.tangent = correction.rest_tangent = mailbox.delivery.tangent;
  correction.rest_field = mailbox.field;
  drop_correction(set);
  correction.change = static_cast<double>(INFINITY);
  for (double& change : correction.force_change) change = -1;
  if (is_strained_now && request.is_strained && mailbox.delivery.is_good && has_exterior(set))
    take_correction(mailbox, set.followed, set.displacement, frame);
  memset(set.coupled_force, 0, set.num_axes * sizeof *set.coupled_force);
  std::swap(state.tangents, mailbox.delivery.tangents);
  use_tangents(state.tangents, mailbox.delivery.made, set);
  for (uint32_t g = 0; g < set.num_groups && request.is_strained && !is_strained_now; ++g)
    rest_group(pack, set, set.groups[g]);
  set.ready = true;
  std::swap(state.active, set);
}

}  // namespace palpate
