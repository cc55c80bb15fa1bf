#include "offline/pack/pack_tables.hpp"

namespace palpate {

MeshTables mesh_tables(const PackContent& content, const std::vector<int>& nodes,
                       const std::vector<int>& elements, const std::vector<uint32_t>& volume_patches) {
  const Model& model = content.model;
  std::vector<uint32_t> index_of(static_cast<size_t>(model.num_nodes()), pack::kNoNode);
  std::vector<uint32_t> packed(index_of.size(), pack::kNoNode);
  for (size_t i = 0; i < nodes.size(); ++i)
    index_of[static_cast<size_t>(nodes[i])] = static_cast<uint32_t>(i);
  for (size_t i = 0; i < content.sites.packed_nodes.size(); ++i)
    packed[static_cast<size_t>(content.sites.packed_nodes[i])] = static_cast<uint32_t>(i);
  MeshTables mesh;
  std::vector<std::vector<uint32_t>> of_node(nodes.size());
  for (size_t i = 0; i < elements.size(); ++i) {
    const Tetrahedron& tetrahedron = model.elements[static_cast<size_t>(elements[i])];
    pack::ZoneElement element = {};
    element.num_nodes = static_cast<uint32_t>(tetrahedron.num_nodes);
    element.material = static_cast<uint32_t>(tetrahedron.material);
    element.volume_patch = volume_patches[i];
    for (size_t a = 0; a < tetrahedron.nodes().size(); ++a) {
      element.nodes[a] = index_of[static_cast<size_t>(tetrahedron.nodes()[a])];
      of_node[element.nodes[a]].push_back(static_cast<uint32_t>(i));
    }
    mesh.elements.push_back(element);
  }
  const std::vector<char> fixed = model.fixed_dofs();
  const Eigen::VectorXd at_rest = content.rest != nullptr ? content.rest->displacement_of(model)
                                                          : Eigen::VectorXd::Zero(model.num_dofs());
  for (size_t i = 0; i < nodes.size(); ++i) {
    const auto at = static_cast<size_t>(nodes[i]);
    pack::ZoneNode node = {};
    for (size_t axis = 0; axis < 3; ++axis) {
      node.position[axis] = model.positions[at][static_cast<Eigen::Index>(axis)];
      node.displacement[axis] = at_rest[static_cast<Eigen::Index>(3 * at + axis)];
      if (fixed[3 * at + axis] == 0) node.free_axes |= 1U << axis;
    }
    node.packed_node = packed[at];
    node.first_element = static_cast<uint32_t>(mesh.node_elements.size());
    node.num_elements = static_cast<uint32_t>(of_node[i].size());
    mesh.node_elements.insert(mesh.node_elements.end(), of_node[i].begin(), of_node[i].end());
    mesh.nodes.push_back(node);
  }
  return mesh;
}

}  // namespace palpate
