#include "runtime/src/refining/preparation.hpp"

#include <string.h>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
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

}  // namespace palpate
