#include "offline/pack/pack_tables.hpp"
#include "offline/precompute/organ_tree.hpp"

namespace palpate {
namespace {

std::vector<pack::ZoneElement> organ_elements(const Model& model, const OrganTree& tree) {
  std::vector<uint32_t> index_of(static_cast<size_t>(model.num_nodes()), pack::kNoNode);
  for (size_t i = 0; i < tree.nodes.size(); ++i)
    index_of[static_cast<size_t>(tree.nodes[i])] = static_cast<uint32_t>(i);
  std::vector<pack::ZoneElement> elements;
  for (size_t i = 0; i < tree.elements.size(); ++i) {
    const Tetrahedron& tetrahedron = model.elements[static_cast<size_t>(tree.elements[i])];
    pack::ZoneElement element = {};
    element.num_nodes = static_cast<uint32_t>(tetrahedron.num_nodes);
    element.material = static_cast<uint32_t>(tetrahedron.material);
    element.volume_patch = tree.volume_patches[i];
    for (size_t a = 0; a < tetrahedron.nodes().size(); ++a)
      element.nodes[a] = index_of[static_cast<size_t>(tetrahedron.nodes()[a])];
    elements.push_back(element);
  }
  return elements;
}

}  // namespace

OrganSegments add_organ(const PackContent& content, SegmentStore& store) {
  const Model& model = content.model;
  const OrganTree tree = make_organ_tree(model, content.sites);
  const std::vector<pack::ZoneElement> elements = organ_elements(model, tree);
  std::vector<std::vector<uint32_t>> of_node(tree.nodes.size());
  for (size_t e = 0; e < elements.size(); ++e) {
    for (uint32_t a = 0; a < elements[e].num_nodes; ++a)
      of_node[elements[e].nodes[a]].push_back(static_cast<uint32_t>(e));
  }
  std::vector<uint32_t> packed(static_cast<size_t>(model.num_nodes()), pack::kNoNode);
  for (size_t i = 0; i < content.sites.packed_nodes.size(); ++i)
    packed[static_cast<size_t>(content.sites.packed_nodes[i])] = static_cast<uint32_t>(i);
  const std::vector<char> fixed = model.fixed_dofs();
  const Eigen::VectorXd at_rest = content.rest != nullptr ? content.rest->displacement_of(model)
                                                          : Eigen::VectorXd::Zero(model.num_dofs());
  std::vector<pack::ZoneNode> nodes;
  std::vector<uint32_t> node_elements;
  for (size_t i = 0; i < tree.nodes.size(); ++i) {
    const auto at = static_cast<size_t>(tree.nodes[i]);
    pack::ZoneNode node = {};
    for (size_t axis = 0; axis < 3; ++axis) {
      node.position[axis] = model.positions[at][static_cast<Eigen::Index>(axis)];
      node.displacement[axis] = at_rest[static_cast<Eigen::Index>(3 * at + axis)];
      if (fixed[3 * at + axis] == 0) node.free_axes |= 1U << axis;
    }
    node.packed_node = packed[at];
    node.first_element = static_cast<uint32_t>(node_elements.size());
    node.num_elements = static_cast<uint32_t>(of_node[i].size());
    node.row = pack::kNoNode;
    node_elements.insert(node_elements.end(), of_node[i].begin(), of_node[i].end());
    nodes.push_back(node);
  }
  OrganSegments segments = {};
  segments.num_nodes = static_cast<uint32_t>(nodes.size());
  segments.num_free = static_cast<uint32_t>(tree.num_free);
  segments.num_elements = static_cast<uint32_t>(elements.size());
  segments.num_fronts = static_cast<uint32_t>(tree.fronts.size());
  segments.nodes = store.add(nodes);
  segments.elements = store.add(elements);
  segments.node_elements = store.add(node_elements);
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
