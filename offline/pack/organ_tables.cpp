#include <algorithm>

#include "offline/pack/pack_tables.hpp"
#include "offline/precompute/organ_tree.hpp"

namespace palpate {
namespace {

// The places in `all` of some of its numbers; no number stands twice.
std::vector<uint32_t> places_in(const std::vector<int>& all, const std::vector<int>& some) {
  std::vector<uint32_t> place_of(
      all.empty() ? 0 : 1 + static_cast<size_t>(*std::max_element(all.begin(), all.end())));
  for (size_t i = 0; i < all.size(); ++i) place_of[static_cast<size_t>(all[i])] = static_cast<uint32_t>(i);
  std::vector<uint32_t> places;
  places.reserve(some.size());
  for (const int number : some) places.push_back(place_of[static_cast<size_t>(number)]);
  return places;
}

}  // namespace

OrganSegments add_organ(const PackContent& content, SegmentStore& store) {
  const OrganTree tree = make_organ_tree(content.model, content.sites);
  const MeshTables mesh = mesh_tables(content, tree.nodes, tree.elements, tree.volume_patches);
  OrganSegments segments = {};
  segments.num_nodes = static_cast<uint32_t>(mesh.nodes.size());
  segments.num_free = static_cast<uint32_t>(tree.num_free);
  segments.num_elements = static_cast<uint32_t>(mesh.elements.size());
  segments.num_fronts = static_cast<uint32_t>(tree.fronts.size());
  segments.nodes = store.add(mesh.nodes);
  segments.elements = store.add(mesh.elements);
  segments.node_elements = store.add(mesh.node_elements);
  segments.fronts = store.add(tree.fronts);
  segments.order = store.add(tree.order);
  segments.rows = store.add(tree.rows);
  segments.zone_nodes = store.add(places_in(tree.nodes, content.zone->nodes));
  segments.zone_elements = store.add(places_in(tree.elements, content.zone->elements));
  return segments;
}

flatbuffers::Offset<pack::Organ> create_organ(const OrganSegments& organ, uint64_t base,
                                              flatbuffers::FlatBufferBuilder& builder) {
  const pack::Segment nodes = placed(organ.nodes, base);
  const pack::Segment elements = placed(organ.elements, base);
  const pack::Segment node_elements = placed(organ.node_elements, base);
  const pack::Segment fronts = placed(organ.fronts, base);
  const pack::Segment order = placed(organ.order, base);
  const pack::Segment rows = placed(organ.rows, base);
  const pack::Segment zone_nodes = placed(organ.zone_nodes, base);
  const pack::Segment zone_elements = placed(organ.zone_elements, base);
  return pack::CreateOrgan(builder, organ.num_nodes, organ.num_free, &nodes, organ.num_elements, &elements,
                           &node_elements, organ.num_fronts, &fronts, &order, &rows, &zone_nodes,
                           &zone_elements);
}

}  // namespace palpate
