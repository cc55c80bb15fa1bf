#include "offline/mesh/model.hpp"

#include <algorithm>

namespace palpate {

double Amplitude::at(double time) const {
  const auto after =
      std::upper_bound(points.begin(), points.end(), time,
                       [](double t, const std::array<double, 2>& point) { return t < point[0]; });
  if (after == points.begin()) return points.front()[1];
  if (after == points.end()) return points.back()[1];
  const auto& [t0, a0] = *(after - 1);
  const auto& [t1, a1] = *after;
  return a0 + (a1 - a0) * ((time - t0) / (t1 - t0));
}

bool Model::small_strain() const {
  return std::any_of(materials.begin(), materials.end(), [](const Material& material) {
    return std::holds_alternative<LinearElastic>(material.law);
  });
}

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
  // Most labels count up without gaps: the first guess is the offset from the first label.
  if (label_index.empty() || label < label_index.front().first) return -1;
  const size_t offset = static_cast<size_t>(label) - static_cast<size_t>(label_index.front().first);
  if (offset < label_index.size() && label_index[offset].first == label) return label_index[offset].second;
  const auto found = std::lower_bound(label_index.begin(), label_index.end(), std::pair(label, 0));
  return found != label_index.end() && found->first == label ? found->second : -1;
}

}  // namespace palpate
