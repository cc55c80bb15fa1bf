#include "offline/mesh/largest_part.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "offline/mesh/rigid_motion.hpp"

namespace palpate {
namespace {

std::size_t position_of(int index) {
  return static_cast<std::size_t>(index);
}

// Removes the items with the new index -1, and moves the others to their new index, which is never larger.
template <typename Item>
void compact(std::vector<Item>& items, const std::vector<int>& new_index) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (new_index[i] < 0) continue;
    if (kept != i) items[kept] = std::move(items[i]);
    ++kept;
  }
  items.erase(items.begin() + static_cast<std::ptrdiff_t>(kept), items.end());
}

void renumber_members(std::map<std::string, std::vector<int>>& sets, const std::vector<int>& new_index) {
  for (auto& [name, members] : sets) {
    for (int& member : members) member = new_index[position_of(member)];
    std::erase(members, -1);
  }
  std::erase_if(sets, [](const auto& set) { return set.second.empty(); });
}

// Numbers the items for which `is_kept` holds, and gives -1 to the others.
template <typename Condition>
std::vector<int> number_kept(std::size_t size, const Condition& is_kept) {
  std::vector<int> index(size, -1);
  int next = 0;
  for (std::size_t i = 0; i < size; ++i) {
    if (is_kept(i)) index[i] = next++;
  }
  return index;
}

}  // namespace

void keep_largest_part(Model& model) {
  const std::vector<int> part = connected_parts(model);
  const int num_parts = part.empty() ? 0 : 1 + *std::max_element(part.begin(), part.end());
  if (num_parts < 2) return;
  const auto part_of = [&](const Tetrahedron& element) { return part[position_of(element.node_array[0])]; };
  std::vector<int> num_elements(position_of(num_parts), 0);
  for (const Tetrahedron& element : model.elements) ++num_elements[position_of(part_of(element))];
  const auto largest =
      static_cast<int>(std::max_element(num_elements.begin(), num_elements.end()) - num_elements.begin());
  const std::vector<int> node_index =
      number_kept(part.size(), [&](std::size_t node) { return part[node] == largest; });
  const std::vector<int> element_index = number_kept(
      model.elements.size(), [&](std::size_t i) { return part_of(model.elements[i]) == largest; });
  const std::size_t nodes_before = model.positions.size();
  const std::size_t elements_before = model.elements.size();
  compact(model.positions, node_index);
  compact(model.labels, node_index);
  compact(model.elements, element_index);
  for (Tetrahedron& element : model.elements) {
    for (int& node : element.nodes()) node = node_index[position_of(node)];
  }
  renumber_members(model.node_sets, node_index);
  renumber_members(model.element_sets, element_index);
  for (PrescribedDisplacement& dof : model.fixed) dof.node = node_index[position_of(dof.node)];
  std::erase_if(model.fixed, [](const PrescribedDisplacement& dof) { return dof.node < 0; });
  for (auto& [label, node] : model.label_index) node = node_index[position_of(node)];
  std::erase_if(model.label_index, [](const std::pair<int, int>& entry) { return entry.second < 0; });
  model.warnings.push_back(fmt::format(
      "{}: kept the largest of {} parts, and dropped {} nodes and {} elements of the others", model.file,
      num_parts, nodes_before - model.positions.size(), elements_before - model.elements.size()));
}

}  // namespace palpate
