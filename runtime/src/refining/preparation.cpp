#include "runtime/src/refining/preparation.hpp"

#include <string.h>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

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

}  // namespace

void carve_preparation(const pal_pack& pack, const ZoneRoom& room, Arena& arena,
                       ZonePreparation& preparation) {
  preparation = {};
  preparation.room = room;
  carve_set(pack, room, arena, preparation.set);
  carve_work(room, arena, preparation.work);
  preparation.node_contacts = arena.take<ContactBits>(pack.organ.num_nodes);
  preparation.element_contacts = arena.take<ContactBits>(pack.organ.num_elements);
  preparation.found_nodes = arena.take<uint32_t>(room.nodes);
  preparation.found_elements = arena.take<uint32_t>(room.elements);
  preparation.queue = arena.take<uint32_t>(room.nodes);
  preparation.place_of = arena.take<uint32_t>(pack.organ.num_nodes);
  preparation.group_of_element = arena.take<uint8_t>(pack.organ.num_elements);
}

void refuse_set(ZonePreparation& preparation) {
  preparation.set.sound = false;
  preparation.set.num_nodes = preparation.set.num_groups = 0;
}

bool begin_rest(ZonePreparation& preparation) {
  ZoneSet& set = preparation.set;
  bool fits = set.sound && exterior_size(set) <= preparation.room.exterior;
  for (uint32_t g = 0; g < set.num_groups && fits; ++g) fits = take_rows(preparation, set.groups[g]);
  preparation.group = preparation.step = 0;
  if (!fits) refuse_set(preparation);
  return fits;
}

bool advance_rest(const pal_pack& pack, uint64_t operations, ZonePreparation& preparation, uint64_t& spent) {
  ZoneSet& set = preparation.set;
  if (preparation.group == 0 && preparation.step == 0) {
    for (uint32_t i = 0; i < set.num_nodes; ++i)
      memcpy(set.displacement + size_t{3} * i, node_at(pack, set, i).displacement, 3 * sizeof(double));
    memset(set.rest_force, 0, size_t{3} * set.num_nodes * sizeof *set.rest_force);
  }
  for (; preparation.group < set.num_groups; ++preparation.group, preparation.step = 0) {
    const ZoneBatches& batches = set.groups[preparation.group].batches;
    for (; preparation.step < num_parts(batches); ++preparation.step) {
      if (spent >= operations) return false;
      const ZoneBatches part = part_of(batches, preparation.step);
      add_zone_forces(part, set.displacement, set.rest_force);
      for (ZonePatch* patch = part.patches; patch < part.patches + part.num_patches; ++patch)
        patch->followed = patch->at_rest = patch->pressure;
      spent += force_operations(part);
    }
  }
  preparation.group = 0;
  return true;
}

}  // namespace palpate
