#include "runtime/src/refining/zone_members.hpp"

#include <string.h>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

uint32_t patch_begin(const pal_pack& pack, uint32_t site) {
  return pack.patch_starts[site];
}
uint32_t patch_end(const pal_pack& pack, uint32_t site) {
  return pack.patch_starts[site + 1];
}

bool holds(const pal_pack& pack, uint32_t site, uint32_t node) {
  for (uint32_t p = patch_begin(pack, site); p < patch_end(pack, site); ++p) {
    if (pack.patch_nodes[p] == node) return true;
  }
  return false;
}

// Marks what the zone of a contact holds, ring by ring. False where it is more than a pack may hold.
bool mark_zone(const pal_pack& pack, uint32_t contact, uint32_t site, ZonePreparation& preparation) {
  const uint64_t bit = uint64_t{1} << contact;
  uint32_t num_queued = 0;
  const auto add_node = [&](uint32_t node) {
    uint64_t& contacts = preparation.node_contacts[node];
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
    uint64_t& contacts = preparation.element_contacts[index];
    if ((contacts & bit) != 0) return true;
    if (contacts == 0) {
      if (preparation.num_found_elements == preparation.room.elements) return false;
      preparation.found_elements[preparation.num_found_elements++] = index;
    }
    contacts |= bit;
    const pack::ZoneElement& element = pack.zone_elements[index];
    for (uint32_t a = 0; a < element.num_nodes; ++a) {
      if (!add_node(element.nodes[a])) return false;
    }
    return true;
  };
  uint32_t ring_begin = 0;
  for (uint32_t ring = 0; ring < preparation.room.rings; ++ring) {
    const uint32_t ring_end = num_queued;
    for (uint32_t q = ring_begin; q < ring_end; ++q) {
      const pack::ZoneNode& node = pack.zone_nodes[preparation.queue[q]];
      for (uint32_t e = 0; e < node.num_elements; ++e) {
        if (!add_element(pack.zone_node_elements[node.first_element + e])) return false;
      }
    }
    ring_begin = ring_end;
  }
  // The rest of their volume patches, which follow one another.
  for (uint32_t i = 0; i < preparation.num_found_elements; ++i) {
    const uint32_t index = preparation.found_elements[i];
    const uint32_t patch = pack.zone_elements[index].volume_patch;
    if (patch == pack::kNoPatch || (preparation.element_contacts[index] & bit) == 0) continue;
    const auto is_of_patch = [&](uint32_t other) { return pack.zone_elements[other].volume_patch == patch; };
    for (uint32_t other = index; other > 0 && is_of_patch(other - 1); --other) {
      if (!add_element(other - 1)) return false;
    }
    for (uint32_t other = index + 1; other < pack.num_zone_elements && is_of_patch(other); ++other) {
      if (!add_element(other)) return false;
    }
  }
  return true;
}

// Marks the nodes that are fixed while running. Those in no zone are listed with that of the first contact. False where that
// is more than fit.
bool mark_fixed(ZonePreparation& preparation) {
  const ZoneSet& set = preparation.set;
  for (uint32_t i = 0; i < set.num_fixed; ++i) {
    uint64_t& contacts = preparation.node_contacts[set.fixed[i]];
    if (contacts != 0) continue;
    if (preparation.num_found_nodes == preparation.room.nodes) return false;
    preparation.found_nodes[preparation.num_found_nodes++] = set.fixed[i];
    contacts = 1;
  }
  return true;
}

void forget_marks(ZonePreparation& preparation) {
  for (uint32_t i = 0; i < preparation.num_found_nodes; ++i)
    preparation.node_contacts[preparation.found_nodes[i]] = 0;
  for (uint32_t i = 0; i < preparation.num_found_elements; ++i)
    preparation.element_contacts[preparation.found_elements[i]] = 0;
  preparation.num_found_nodes = 0;
  preparation.num_found_elements = 0;
}

// Contacts that share nodes, directly or through others, are a group: all that it names is whose they are.
void find_groups(ZonePreparation& preparation) {
  ZoneSet& set = preparation.set;
  const uint32_t count = set.num_contacts;
  uint64_t groups[kMostZoneContacts];
  for (uint32_t c = 0; c < count; ++c) groups[c] = uint64_t{1} << c;
  for (uint32_t i = 0; i < preparation.num_found_nodes; ++i) {
    const uint64_t contacts = preparation.node_contacts[preparation.found_nodes[i]];
    uint64_t joined = 0;
    for (uint32_t c = 0; c < count; ++c) {
      if ((contacts >> c & 1) != 0) joined |= groups[c];
    }
    for (uint32_t c = 0; c < count; ++c) {
      if ((joined >> c & 1) != 0) groups[c] = joined;
    }
  }
  for (uint32_t c = 0; c < count; ++c) {
    if ((groups[c] & ((uint64_t{1} << c) - 1)) != 0) continue;
    ZoneGroup& group = set.groups[set.num_groups++];
    group = {};
    for (uint32_t other = c; other < count; ++other) {
      if ((groups[c] >> other & 1) != 0) group.contacts[group.num_contacts++] = other;
    }
  }
}

// Of the elements at a node, those in the zone.
uint32_t num_inside(const pal_pack& pack, const ZonePreparation& preparation, uint32_t node, uint64_t group) {
  const pack::ZoneNode& entry = pack.zone_nodes[node];
  uint32_t count = 0;
  for (uint32_t e = 0; e < entry.num_elements; ++e) {
    const uint32_t index = pack.zone_node_elements[entry.first_element + e];
    count += (preparation.element_contacts[index] & group) != 0 ? 1 : 0;
  }
  return count;
}

// The contacts that hold a node, as masters of it; how many. `num_masters` counts them on.
uint32_t list_masters(const pal_pack& pack, const ZoneSet& set, const ZoneGroup& group, uint32_t node,
                      uint32_t& num_masters) {
  uint32_t count = 0;
  for (uint32_t slot = 0; slot < group.num_contacts; ++slot) {
    if (!holds(pack, set.sites[group.contacts[slot]], node)) continue;
    const uint32_t own = group.unknowns + 3 * slot;
    const uint32_t turns = 3 * group.num_contacts;
    set.masters[num_masters + count++] = {own, group.num_axes > turns ? own + turns : kNoUnknown, 0.0, {}};
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
  kBoundary,
  kHeld,
  kFixed
};  // kFixed: in the model, while kBoundary may be fixed too
constexpr uint32_t kRoles = 4;

Role role_of(const pal_pack& pack, const ZonePreparation& preparation, const ZoneGroup& group, uint64_t mask,
             uint32_t node) {
  const pack::ZoneNode& entry = pack.zone_nodes[node];
  if (entry.free_axes == 0) return kFixed;
  if (is_fixed(preparation.set, node)) return kBoundary;
  for (uint32_t slot = 0; slot < group.num_contacts; ++slot) {
    if (holds(pack, preparation.set.sites[group.contacts[slot]], node)) return kHeld;
  }
  return entry.num_outside > 0 || num_inside(pack, preparation, node, mask) < entry.num_elements ? kBoundary
                                                                                                 : kInterior;
}

// The group's nodes, role by role. False where that is more than fit.
bool list_nodes(const pal_pack& pack, uint64_t mask, ZonePreparation& preparation, ZoneGroup& group) {
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
  if (set.num_nodes + counts[kInterior] + counts[kBoundary] + counts[kHeld] + counts[kFixed] >
      preparation.room.nodes)
    return false;
  group.first_node = set.num_nodes;
  group.num_interior = counts[kInterior];
  group.num_boundary = counts[kBoundary];
  group.num_held = counts[kHeld];
  uint32_t places[kRoles];
  for (uint32_t role = 0; role < kRoles; ++role) {
    places[role] = set.num_nodes;
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
    const uint32_t place = places[roles[i]]++;
    set.nodes[place] = node;
    switch (roles[i]) {
      case kHeld:
        set.unknown_of[place] = kHeldUnknown;
        set.first_master[place] = preparation.used.masters;
        if (list_masters(pack, set, group, node, preparation.used.masters) > 1)
          set.flags |= PAL_FLAG_OVERLAPPING;
        set.first_master[place + 1] = preparation.used.masters;
        break;
      case kFixed:
        set.unknown_of[place] = kNoUnknown;
        break;
      default:
        set.unknown_of[place] = is_fixed(set, node) ? kNoUnknown : 3 * (place - group.first_node);
    }
  }
  return true;
}

// The place of an element's volume patch among the group's, or kNoPatch.
uint32_t patch_of(const pal_pack& pack, const pack::ZoneElement& element, ZoneBatches& batches) {
  if (element.volume_patch == pack::kNoPatch) return pack::kNoPatch;
  uint32_t place = 0;
  while (place < batches.num_patches && batches.patches[place].number != element.volume_patch) ++place;
  if (place == batches.num_patches) {
    batches.patches[place] = {};
    batches.patches[place].material = pack.zone_materials + element.material;
    batches.patches[place].number = element.volume_patch;
    ++batches.num_patches;
  }
  return place;
}

template <int kNodes>
bool append_element(const pal_pack& pack, const pack::ZoneElement& element, const uint32_t* place_of,
                    uint32_t count, ZoneBatches& group, ZoneBatch<kNodes>* batches) {
  ZoneBatch<kNodes>& batch = batches[count / kLanes];
  int nodes[kNodes];
  for (uint32_t a = 0; a < kNodes; ++a) nodes[a] = static_cast<int>(place_of[element.nodes[a]] - 1);
  const int first = static_cast<int>(count % kLanes);
  batch.count = first + 1;
  const uint32_t patch = patch_of(pack, element, group);
  for (int lane = first; lane < kLanes; ++lane) {
    if (!set_zone_element<kNodes>(pack.zone_nodes, pack.zone_materials, element, nodes, patch, lane, batch))
      return false;
  }
  for (const auto& point : batch.elements.points) {
    if (patch != pack::kNoPatch) group.patches[patch].volume += point.volume[first];
  }
  return true;
}

// The group's elements, in lanes.
bool list_elements(const pal_pack& pack, uint64_t mask, ZonePreparation& preparation, ZoneGroup& group) {
  ZoneSet& set = preparation.set;
  for (uint32_t i = 0; i < group.num_nodes; ++i)
    preparation.place_of[set.nodes[group.first_node + i]] = group.first_node + i + 1;
  group.batches.linear = set.linear + preparation.used.linear;
  group.batches.quadratic = set.quadratic + preparation.used.quadratic;
  group.batches.patches = set.patches + preparation.used.patches;
  uint32_t num_linear = 0;
  uint32_t num_quadratic = 0;
  bool sound = true;
  for (uint32_t i = 0; i < preparation.num_found_elements && sound; ++i) {
    const uint32_t index = preparation.found_elements[i];
    if ((preparation.element_contacts[index] & mask) == 0) continue;
    if (set.num_elements == preparation.room.elements) return false;
    set.elements[set.num_elements++] = index;
    ++group.num_elements;
    const pack::ZoneElement& element = pack.zone_elements[index];
    if (element.num_nodes == 4) {
      sound = append_element(pack, element, preparation.place_of, num_linear++, group.batches,
                             group.batches.linear);
    } else if (num_quadratic < preparation.room.quadratic) {
      sound = append_element(pack, element, preparation.place_of, num_quadratic++, group.batches,
                             group.batches.quadratic);
    } else {
      sound = false;
    }
  }
  for (uint32_t i = 0; i < group.num_nodes; ++i) preparation.place_of[set.nodes[group.first_node + i]] = 0;
  group.batches.num_linear = (num_linear + kLanes - 1) / kLanes;
  group.batches.num_quadratic = (num_quadratic + kLanes - 1) / kLanes;
  preparation.used.linear += group.batches.num_linear;
  preparation.used.quadratic += group.batches.num_quadratic;
  preparation.used.patches += group.batches.num_patches;
  return sound;
}

bool list_group(const pal_pack& pack, ZonePreparation& preparation, ZoneGroup& group) {
  uint64_t mask = 0;
  for (uint32_t slot = 0; slot < group.num_contacts; ++slot) mask |= uint64_t{1} << group.contacts[slot];
  const bool fits = list_nodes(pack, mask, preparation, group);
  preparation.used.boundary += group.num_boundary;
  return fits && preparation.used.boundary <= preparation.room.boundary &&
         list_elements(pack, mask, preparation, group);
}

// False where it is more than fits.
bool list_some(const pal_pack& pack, ZonePreparation& preparation) {
  ZoneSet& set = preparation.set;
  const uint32_t step = preparation.column;
  if (step < set.num_contacts) return mark_zone(pack, step, set.sites[step], preparation);
  if (step == set.num_contacts) {
    find_groups(preparation);
    return mark_fixed(preparation);
  }
  return list_group(pack, preparation, set.groups[step - set.num_contacts - 1]);
}

}  // namespace

void begin_members(ZonePreparation& preparation) {
  forget_marks(preparation);
  preparation.column = 0;
  preparation.set.num_groups = preparation.set.num_nodes = preparation.set.num_elements = 0;
  preparation.used = {};
}

bool collect_members(const pal_pack& pack, uint64_t operations, ZonePreparation& preparation,
                     uint64_t& spent) {
  constexpr uint64_t kOfMember = 18000;
  ZoneSet& set = preparation.set;
  while (preparation.column < set.num_contacts + 1 + set.num_groups) {
    if (spent >= operations) return false;
    if (!list_some(pack, preparation)) {
      set.sound = false;
      break;
    }
    spent += kOfMember * (preparation.num_found_nodes / set.num_contacts + 1);
    ++preparation.column;
  }
  set.num_masters = preparation.used.masters;
  forget_marks(preparation);
  return true;
}

}  // namespace palpate
