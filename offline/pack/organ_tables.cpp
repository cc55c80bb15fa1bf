#include "offline/pack/pack_tables.hpp"
#include "offline/precompute/organ_tree.hpp"

namespace palpate {
namespace {

// Returns the elements; their nodes are indices in OrganTree::nodes.
std::vector<pack::OrganElement> organ_elements(const Model& model, const OrganTree& tree) {
  std::vector<uint32_t> place_of(static_cast<size_t>(model.num_nodes()), pack::kNoNode);
  for (size_t i = 0; i < tree.nodes.size(); ++i)
    place_of[static_cast<size_t>(tree.nodes[i])] = static_cast<uint32_t>(i);
  std::vector<pack::OrganElement> elements;
  for (size_t i = 0; i < tree.elements.size(); ++i) {
    const Tetrahedron& tetrahedron = model.elements[static_cast<size_t>(tree.elements[i])];
    pack::OrganElement element = {};
    element.num_nodes = static_cast<uint32_t>(tetrahedron.num_nodes);
    element.material = static_cast<uint32_t>(tetrahedron.material);
    element.volume_patch = tree.volume_patches[i];
    for (size_t a = 0; a < tetrahedron.nodes().size(); ++a)
      element.nodes[a] = place_of[static_cast<size_t>(tetrahedron.nodes()[a])];
    elements.push_back(element);
  }
  return elements;
}

// Returns the nodes; list_node_elements() adds their elements.
std::vector<pack::OrganNode> organ_nodes(const PackContent& content, const OrganTree& tree) {
  const Model& model = content.model;
  std::vector<uint32_t> packed(static_cast<size_t>(model.num_nodes()), pack::kNoNode);
  for (size_t i = 0; i < content.sites.packed_nodes.size(); ++i)
    packed[static_cast<size_t>(content.sites.packed_nodes[i])] = static_cast<uint32_t>(i);
  const std::vector<char> fixed = model.fixed_dofs();
  const Eigen::VectorXd at_rest = content.rest != nullptr ? content.rest->displacement_of(model)
                                                          : Eigen::VectorXd::Zero(model.num_dofs());
  std::vector<pack::OrganNode> nodes;
  for (const int model_node : tree.nodes) {
    const auto at = static_cast<size_t>(model_node);
    pack::OrganNode node = {};
    for (size_t axis = 0; axis < 3; ++axis) {
      node.position[axis] = model.positions[at][static_cast<Eigen::Index>(axis)];
      node.displacement[axis] = at_rest[static_cast<Eigen::Index>(3 * at + axis)];
      if (fixed[3 * at + axis] == 0) node.free_axes |= 1U << axis;
    }
    node.packed_node = packed[at];
    nodes.push_back(node);
  }
  return nodes;
}

// Returns the elements of each node, node after node. Sets first_element and num_elements of the nodes.
std::vector<uint32_t> list_node_elements(const std::vector<pack::OrganElement>& elements,
                                         std::vector<pack::OrganNode>& nodes) {
  std::vector<std::vector<uint32_t>> elements_of_node(nodes.size());
  for (size_t e = 0; e < elements.size(); ++e) {
    for (uint32_t a = 0; a < elements[e].num_nodes; ++a)
      elements_of_node[elements[e].nodes[a]].push_back(static_cast<uint32_t>(e));
  }
  std::vector<uint32_t> all;
  for (size_t i = 0; i < nodes.size(); ++i) {
    nodes[i].first_element = static_cast<uint32_t>(all.size());
    nodes[i].num_elements = static_cast<uint32_t>(elements_of_node[i].size());
    all.insert(all.end(), elements_of_node[i].begin(), elements_of_node[i].end());
  }
  return all;
}

}  // namespace

OrganSegments add_organ(const PackContent& content, SegmentStore& store) {
  const OrganTree tree = make_organ_tree(content.model, content.sites);
  const std::vector<pack::OrganElement> elements = organ_elements(content.model, tree);
  std::vector<pack::OrganNode> nodes = organ_nodes(content, tree);
  const std::vector<uint32_t> node_elements = list_node_elements(elements, nodes);
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
