#include "runtime/src/refining/zone_members.hpp"

#include <string.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_balance.hpp"

namespace palpate {
namespace {

uint32_t patch_begin(const pal_pack& pack, uint32_t site) {
  return pack.patch_starts[site];
}
uint32_t patch_end(const pal_pack& pack, uint32_t site) {
  return pack.patch_starts[site + 1];
}

bool patch_holds(const pal_pack& pack, uint32_t site, uint32_t node) {
  for (uint32_t p = patch_begin(pack, site); p < patch_end(pack, site); ++p) {
    if (pack.patch_nodes[p] == node) return true;
  }
  return false;
}

ContactBits bit_of(uint32_t contact) {
  return static_cast<ContactBits>(1U << contact);
}

// Marks the nodes and elements of a contact's zone, ring by ring. Returns false if the room does not suffice.
bool mark_zone(const pal_pack& pack, uint32_t contact, uint32_t site, ZonePreparation& preparation) {
  const OrganView& organ = pack.organ;
  const ContactBits bit = bit_of(contact);
  uint32_t num_queued = 0;
  const auto add_node = [&](uint32_t node) {
    ContactBits& contacts = preparation.node_contacts[node];
    if ((contacts & bit) != 0) return true;
    if (num_queued == preparation.room.nodes) return false;
    if (contacts == 0) {
      if (preparation.num_found_nodes == preparation.room.nodes) return false;
      preparation.found_nodes[preparation.num_found_nodes++] = node;
    }
    contacts |= bit;
    preparation.queue[num_queued++] = node;
    return true;
  };
  for (uint32_t p = patch_begin(pack, site); p < patch_end(pack, site); ++p) {
    if (!add_node(pack.patch_nodes[p])) return false;
  }
  const auto add_element = [&](uint32_t index) {
    ContactBits& contacts = preparation.element_contacts[index];
    if ((contacts & bit) != 0) return true;
    if (contacts == 0) {
      if (preparation.num_found_elements == preparation.room.elements) return false;
      preparation.found_elements[preparation.num_found_elements++] = index;
    }
    contacts |= bit;
    const pack::OrganElement& element = organ.elements[index];
    for (uint32_t a = 0; a < element.num_nodes; ++a) {
      if (!add_node(element.nodes[a])) return false;
    }
    return true;
  };
  uint32_t ring_begin = 0;
  for (uint32_t ring = 0; ring < preparation.room.rings; ++ring) {
    const uint32_t ring_end = num_queued;
    for (uint32_t q = ring_begin; q < ring_end; ++q) {
      const pack::OrganNode& node = organ.nodes[preparation.queue[q]];
      for (uint32_t e = 0; e < node.num_elements; ++e) {
        if (!add_element(organ.node_elements[node.first_element + e])) return false;
      }
    }
    ring_begin = ring_end;
  }
  // A zone has whole volume patches, whose elements are consecutive.
  for (uint32_t i = 0; i < preparation.num_found_elements; ++i) {
    const uint32_t index = preparation.found_elements[i];
    const uint32_t patch = organ.elements[index].volume_patch;
    if (patch == pack::kNoPatch || (preparation.element_contacts[index] & bit) == 0) continue;
    const auto is_of_patch = [&](uint32_t other) { return organ.elements[other].volume_patch == patch; };
    for (uint32_t other = index; other > 0 && is_of_patch(other - 1); --other) {
      if (!add_element(other - 1)) return false;
    }
    for (uint32_t other = index + 1; other < organ.num_elements && is_of_patch(other); ++other) {
      if (!add_element(other)) return false;
    }
  }
  return true;
}

// Marks the nodes that are fixed while running. A node in no zone joins the zone of the first contact.
// Returns false if the room does not suffice.
bool mark_fixed(ZonePreparation& preparation) {
  const ZoneSet& set = preparation.set;
  for (uint32_t i = 0; i < set.num_fixed; ++i) {
    ContactBits& contacts = preparation.node_contacts[set.fixed[i]];
    if (contacts != 0) continue;
    if (preparation.num_found_nodes == preparation.room.nodes) return false;
    preparation.found_nodes[preparation.num_found_nodes++] = set.fixed[i];
    contacts = bit_of(0);
  }
  return true;
}

void clear_marks(ZonePreparation& preparation) {
  for (uint32_t i = 0; i < preparation.num_found_nodes; ++i)
    preparation.node_contacts[preparation.found_nodes[i]] = 0;
  for (uint32_t i = 0; i < preparation.num_found_elements; ++i)
    preparation.element_contacts[preparation.found_elements[i]] = 0;
  preparation.num_found_nodes = 0;
  preparation.num_found_elements = 0;
}

// Finds the groups: contacts whose zones share nodes, directly or through other contacts.
void find_groups(ZonePreparation& preparation) {
  ZoneSet& set = preparation.set;
  const uint32_t count = set.num_contacts;
  ContactBits groups[kMostZoneContacts];
  for (uint32_t c = 0; c < count; ++c) groups[c] = bit_of(c);
  for (uint32_t i = 0; i < preparation.num_found_nodes; ++i) {
    const ContactBits contacts = preparation.node_contacts[preparation.found_nodes[i]];
    ContactBits joined = 0;
    for (uint32_t c = 0; c < count; ++c) {
      if ((contacts >> c & 1) != 0) joined |= groups[c];
    }
    for (uint32_t c = 0; c < count; ++c) {
      if ((joined >> c & 1) != 0) groups[c] = joined;
    }
  }
  for (uint32_t c = 0; c < count; ++c) {
    if ((groups[c] & (bit_of(c) - 1)) != 0) continue;
    ZoneGroup& group = set.groups[set.num_groups++];
    group = {};
    for (uint32_t other = c; other < count; ++other) {
      if ((groups[c] >> other & 1) != 0) group.contacts[group.num_contacts++] = other;
    }
  }
}

// Whether an element at the node is outside of the zone of the contacts in `mask`.
bool has_outside(const pal_pack& pack, const ZonePreparation& preparation, ContactBits mask, uint32_t node) {
  const pack::OrganNode& entry = pack.organ.nodes[node];
  const uint32_t* elements = pack.organ.node_elements + entry.first_element;
  return std::any_of(elements, elements + entry.num_elements,
                     [&](uint32_t index) { return (preparation.element_contacts[index] & mask) == 0; });
}

// Lists the contacts that hold the node as its masters. Returns their number and adds it to `num_masters`.
uint32_t list_masters(const pal_pack& pack, const ZoneSet& set, const ZoneGroup& group, uint32_t node,
                      uint32_t& num_masters) {
  uint32_t count = 0;
  for (uint32_t slot = 0; slot < group.num_contacts; ++slot) {
    if (!patch_holds(pack, set.sites[group.contacts[slot]], node)) continue;
    const uint32_t row = group.unknowns + 3 * slot;
    const uint32_t offset = 3 * group.num_contacts;  // from displacement to rotation
    set.masters[num_masters + count++] = {row, group.num_axes > offset ? row + offset : kNoUnknown, 0.0, {}};
  }
  for (uint32_t m = 0; m < count; ++m) set.masters[num_masters + m].share = 1.0 / count;
  num_masters += count;
  return count;
}

bool is_fixed(const ZoneSet& set, uint32_t node) {
  for (uint32_t i = 0; i < set.num_fixed; ++i) {
    if (set.fixed[i] == node) return true;
  }
  return false;
}

enum Role : uint32_t {
  kInterior,
  kBoundary,  // also a node of elements outside of the zone, or fixed while running
  kHeld,      // held by a contact
  kSupported  // without a free axis in the model
};
constexpr uint32_t kRoles = 4;

Role role_of(const pal_pack& pack, const ZonePreparation& preparation, const ZoneGroup& group,
             ContactBits mask, uint32_t node) {
  if (pack.organ.nodes[node].free_axes == 0) return kSupported;
  if (is_fixed(preparation.set, node)) return kBoundary;
  for (uint32_t slot = 0; slot < group.num_contacts; ++slot) {
    if (patch_holds(pack, preparation.set.sites[group.contacts[slot]], node)) return kHeld;
  }
  return has_outside(pack, preparation, mask, node) ? kBoundary : kInterior;
}

// Lists the group's nodes, role by role. Returns false if the room does not suffice.
bool list_nodes(const pal_pack& pack, ContactBits mask, ZonePreparation& preparation, ZoneGroup& group) {
  ZoneSet& set = preparation.set;
  const auto is_in_group = [&](uint32_t i) {
    return (preparation.node_contacts[preparation.found_nodes[i]] & mask) != 0;
  };
  uint32_t* roles = preparation.queue;
  uint32_t counts[kRoles] = {};
  for (uint32_t i = 0; i < preparation.num_found_nodes; ++i) {
    if (is_in_group(i))
      ++counts[roles[i] = role_of(pack, preparation, group, mask, preparation.found_nodes[i])];
  }
  if (set.num_nodes + counts[kInterior] + counts[kBoundary] + counts[kHeld] + counts[kSupported] >
      preparation.room.nodes)
    return false;
  group.first_node = set.num_nodes;
  group.num_interior = counts[kInterior];
  group.num_boundary = counts[kBoundary];
  group.num_held = counts[kHeld];
  uint32_t next_place[kRoles];
  for (uint32_t role = 0; role < kRoles; ++role) {
    next_place[role] = set.num_nodes;
    set.num_nodes += counts[role];
  }
  group.num_nodes = set.num_nodes - group.first_node;
  group.unknowns = round_to_columns(3 * (group.num_interior + group.num_boundary));
  group.num_axes = preparation.room.axes_per_contact * group.num_contacts;
  group.size = group.unknowns + group.num_axes;
  group.stride = elimination_stride(group.size);
  group.boundary_stride = symmetric_stride(3 * group.num_boundary);
  for (uint32_t i = 0; i < preparation.num_found_nodes; ++i) {
    if (!is_in_group(i)) continue;
    const uint32_t node = preparation.found_nodes[i];
    const uint32_t place = next_place[roles[i]]++;
    set.nodes[place] = node;
    preparation.place_of[node] = place;
    switch (roles[i]) {
      case kHeld:
        set.unknown_of[place] = kHeldUnknown;
        set.first_master[place] = preparation.used.masters;
        if (list_masters(pack, set, group, node, preparation.used.masters) > 1)
          set.flags |= PAL_FLAG_OVERLAPPING;
        set.first_master[place + 1] = preparation.used.masters;
        break;
      case kSupported:
        set.unknown_of[place] = kNoUnknown;
        break;
      default:
        set.unknown_of[place] = is_fixed(set, node) ? kNoUnknown : 3 * (place - group.first_node);
    }
  }
  return true;
}

// Returns the index of the element's volume patch in the group, or kNoPatch. Adds a patch that is new.
uint32_t volume_patch_of(const pack::OrganElement& element, ZoneBatches& batches) {
  if (element.volume_patch == pack::kNoPatch) return pack::kNoPatch;
  uint32_t place = 0;
  while (place < batches.num_patches && batches.patches[place].number != element.volume_patch) ++place;
  if (place == batches.num_patches) {
    batches.patches[place] = {};
    batches.patches[place].number = element.volume_patch;
    ++batches.num_patches;
  }
  return place;
}

// Lists the group's elements in SIMD batches (room: mark_zone()). Returns false if an element is inverted.
bool list_elements(const pal_pack& pack, ContactBits mask, ZonePreparation& preparation, ZoneGroup& group) {
  ZoneSet& set = preparation.set;
  ZoneBatches& batches = group.batches;
  batches.linear = set.linear + preparation.used.linear;
  batches.quadratic = set.quadratic + preparation.used.quadratic;
  batches.patches = set.patches + preparation.used.patches;
  const auto number = static_cast<uint8_t>(1 + (&group - set.groups));
  uint32_t num_linear = 0;
  uint32_t num_quadratic = 0;
  bool sound = true;
  for (uint32_t i = 0; i < preparation.num_found_elements && sound; ++i) {
    const uint32_t index = preparation.found_elements[i];
    if ((preparation.element_contacts[index] & mask) == 0) continue;
    preparation.group_of_element[index] = number;
    const pack::OrganElement& element = pack.organ.elements[index];
    const uint32_t patch = volume_patch_of(element, batches);
    sound = element.num_nodes == 4 ? append_element(pack, element, preparation.place_of, patch, num_linear++,
                                                    batches.patches, batches.linear)
                                   : append_element(pack, element, preparation.place_of, patch,
                                                    num_quadratic++, batches.patches, batches.quadratic);
  }
  batches.num_linear = (num_linear + kLanes - 1) / kLanes;
  batches.num_quadratic = (num_quadratic + kLanes - 1) / kLanes;
  group.steepest = steepest_gradient(batches);
  preparation.used.linear += batches.num_linear;
  preparation.used.quadratic += batches.num_quadratic;
  preparation.used.patches += batches.num_patches;
  return sound;
}

// Gives the group its vectors and its places in TangentBuffers. Returns false if the room does not suffice.
bool take_rows(ZonePreparation& preparation, ZoneGroup& group) {
  ZonePreparation::Used& used = preparation.used;
  double* row = preparation.set.rows + used.rows;
  const size_t coupling = size_t{preparation.set.num_axes} * group.boundary_stride;
  const size_t boundary = group.boundary_stride;
  used.rows += coupling + 3 * boundary + size_t{3} * group.unknowns;
  group.matrix_place = used.tangents;
  group.rows_place = used.tangent_rows;
  used.tangents += size_t{round_to_columns(group.size)} * group.stride;
  used.tangent_rows += size_t{group.num_axes} * group.unknowns;
  if (used.rows > preparation.room.rows || used.tangents > preparation.room.tangents ||
      used.tangent_rows > preparation.room.tangent_rows)
    return false;
  const auto take = [&](size_t count) {
    memset(row, 0, count * sizeof *row);
    row += count;
    return row - count;
  };
  group.exterior.force = take(boundary);
  group.exterior.coupled = take(boundary);
  group.exterior.coupled_in_balance = take(boundary);
  group.exterior.coupling = take(coupling);
  group.tangent.step = take(group.unknowns);
  group.trend.unknowns = take(group.unknowns);
  group.trend.began = take(group.unknowns);
  return true;
}

bool list_group(const pal_pack& pack, ZonePreparation& preparation, ZoneGroup& group) {
  ContactBits mask = 0;
  for (uint32_t slot = 0; slot < group.num_contacts; ++slot) mask |= bit_of(group.contacts[slot]);
  const bool fits = list_nodes(pack, mask, preparation, group);
  preparation.used.boundary += group.num_boundary;
  if (!fits || preparation.used.boundary > preparation.room.boundary ||
      !list_elements(pack, mask, preparation, group) || !take_rows(preparation, group))
    return false;
  find_rest_force(pack, preparation.set.displacement, preparation.set, group);
  return true;
}

// Lists a contact's zone, the groups, or a group's members. Returns false if the set becomes unsound.
bool list_next(const pal_pack& pack, ZonePreparation& preparation) {
  ZoneSet& set = preparation.set;
  const uint32_t step = preparation.step;
  if (step < set.num_contacts) return mark_zone(pack, step, set.sites[step], preparation);
  if (step == set.num_contacts) {
    find_groups(preparation);
    return mark_fixed(preparation);
  }
  return list_group(pack, preparation, set.groups[step - set.num_contacts - 1]);
}

}  // namespace

void begin_members(const pal_pack& pack, ZonePreparation& preparation) {
  clear_marks(preparation);
  memset(preparation.group_of_element, 0, pack.organ.num_elements * sizeof *preparation.group_of_element);
  preparation.step = 0;
  preparation.set.num_groups = preparation.set.num_nodes = 0;
  preparation.used = {};
}

Progress collect_members(const pal_pack& pack, uint64_t operations, ZonePreparation& preparation,
                         uint64_t& spent) {
  constexpr uint64_t kOperationsPerNode = 18000;  // multiply-adds counted for each node of a zone
  ZoneSet& set = preparation.set;
  bool fits = true;
  while (fits && preparation.step < set.num_contacts + 1 + set.num_groups) {
    if (spent >= operations) return Progress::goes_on;
    fits = list_next(pack, preparation);
    spent += kOperationsPerNode * (preparation.num_found_nodes / set.num_contacts + 1);
    ++preparation.step;
  }
  set.num_masters = preparation.used.masters;
  clear_marks(preparation);
  return fits && exterior_size(set) <= preparation.room.exterior ? Progress::ended : Progress::failed;
}

}  // namespace palpate
