#include "offline/pack/pack_tables.hpp"
#include "offline/precompute/organ_tree.hpp"

namespace palpate {
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
  return pack::CreateOrgan(builder, organ.num_nodes, organ.num_free, &nodes, organ.num_elements, &elements,
                           &node_elements, organ.num_fronts, &fronts, &order, &rows);
}

}  // namespace palpate
