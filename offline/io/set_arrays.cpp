#include "offline/io/set_arrays.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>

namespace palpate {
namespace {

constexpr std::string_view kSetPrefix = "set:";

using Sets = std::map<std::string, std::vector<int>>;

bool is_set(const MeshArray& array) {
  return array.num_components == 1 && array.name.starts_with(kSetPrefix) &&
         array.name.size() > kSetPrefix.size() &&
         std::ranges::all_of(array.values, [](double value) { return value == 0 || value == 1; });
}

void move_sets(std::vector<MeshArray>& arrays, Sets& sets) {
  for (const MeshArray& array : arrays) {
    if (!is_set(array)) continue;
    std::vector<int>& members = sets[array.name.substr(kSetPrefix.size())];
    members.clear();
    for (std::size_t i = 0; i < array.values.size(); ++i) {
      if (array.values[i] == 1) members.push_back(static_cast<int>(i));
    }
  }
  std::erase_if(arrays, is_set);
}

std::vector<MeshArray> with_sets(std::vector<MeshArray> arrays, const Sets& sets, std::size_t size) {
  for (const auto& [name, members] : sets) {
    MeshArray array = {std::string(kSetPrefix) + name, 1, std::vector<double>(size, 0.0)};
    for (const int member : members) array.values[static_cast<std::size_t>(member)] = 1;
    arrays.push_back(std::move(array));
  }
  return arrays;
}

}  // namespace

void arrays_to_sets(MeshData& mesh) {
  move_sets(mesh.point_arrays, mesh.node_sets);
  move_sets(mesh.cell_arrays, mesh.element_sets);
}

std::vector<MeshArray> point_arrays_with_sets(const MeshData& mesh) {
  return with_sets(mesh.point_arrays, mesh.node_sets, mesh.positions.size());
}

std::vector<MeshArray> cell_arrays_with_sets(const MeshData& mesh) {
  return with_sets(mesh.cell_arrays, mesh.element_sets, mesh.cells.size());
}

bool has_integers(const MeshArray& array) {
  constexpr double kSmallest = std::numeric_limits<std::int32_t>::min();
  constexpr double kLargest = std::numeric_limits<std::int32_t>::max();
  return array.num_components == 1 && std::ranges::all_of(array.values, [](double value) {
           return value >= kSmallest && value <= kLargest && value == std::floor(value);
         });
}

}  // namespace palpate
