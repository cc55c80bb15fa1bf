#include "offline/mesh/model.hpp"

#include <algorithm>

namespace palpate {

std::vector<char> Model::fixed_dofs() const {
  std::vector<char> dofs(static_cast<std::size_t>(num_dofs()), 0);
  for (const PrescribedDisplacement& held : fixed)
    dofs[static_cast<std::size_t>(3 * held.node + held.axis)] = 1;
  return dofs;
}

std::vector<char> Model::fixed_nodes() const {
  std::vector<char> nodes(positions.size(), 0);
  for (const PrescribedDisplacement& held : fixed) nodes[static_cast<std::size_t>(held.node)] = 1;
  return nodes;
}

int Model::find_node(int label) const {
  const auto found = std::lower_bound(label_index.begin(), label_index.end(), std::pair(label, 0));
  return found != label_index.end() && found->first == label ? found->second : -1;
}

}  // namespace palpate
