#include "offline/io/element_moduli.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <utility>

#include "offline/io/set_arrays.hpp"
#include "offline/mesh/input_error.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

// The array with this name and one component. Notes arrays that have more.
const MeshArray* find_array(const std::vector<MeshArray>& arrays, const std::string& name,
                            const std::string& file, std::vector<std::string>& notes) {
  const MeshArray* found = nullptr;
  for (const MeshArray& array : arrays) {
    if (normalised_name(array.name) != name) continue;
    if (array.num_components == 1) {
      found = found == nullptr ? &array : found;
    } else {
      notes.push_back(fmt::format("{}: the array {} has {} components and is ignored; give it one component",
                                  file, printable(array.name), array.num_components));
    }
  }
  return found;
}

// Returns a value for each tetrahedron, or nothing where the mesh has no such array.
std::vector<double> values_of_elements(const MeshData& mesh, const std::string& name,
                                       std::vector<std::string>& notes) {
  const MeshArray* of_cells = find_array(mesh.cell_arrays, name, mesh.file, notes);
  const MeshArray* of_points = find_array(mesh.point_arrays, name, mesh.file, notes);
  if (of_cells != nullptr && of_points != nullptr)
    notes.push_back(
        fmt::format("{}: cells and points have an array {}, and that of the cells counts; remove one",
                    mesh.file, printable(of_cells->name)));
  std::vector<double> values;
  if (of_cells == nullptr && of_points == nullptr) return values;
  for (size_t i = 0; i < mesh.cells.size(); ++i) {
    const MeshCell& cell = mesh.cells[i];
    if (cell.kind != CellKind::tetrahedron) continue;
    double value = 0;
    if (of_cells != nullptr) {
      value = of_cells->values[i];
    } else {
      for (size_t corner = 0; corner < 4; ++corner)
        value += of_points->values[static_cast<size_t>(cell.nodes[corner])] / 4;
    }
    values.push_back(value);
  }
  return values;
}

// Throws at the first value that is not within the limits.
template <typename Condition>
void require(const MeshData& mesh, const std::vector<double>& values, const Condition& holds,
             const std::string& array, const std::string& demand) {
  size_t next = 0;
  for (const MeshCell& cell : mesh.cells) {
    if (cell.kind != CellKind::tetrahedron || values.empty()) continue;
    const double value = values[next++];
    if (holds(value)) continue;
    throw InputError({mesh.file, cell.line},
                     fmt::format("array {}: element {} has {:g}; {}", array, cell.label, value, demand));
  }
}

// Numbers a value in geometric steps.
long step_of(double value, double ratio) {
  return std::lround(std::log(value) / std::log(ratio));
}

struct Range {
  double least = std::numeric_limits<double>::infinity();
  double largest = -std::numeric_limits<double>::infinity();
  void extend(double value) {
    least = std::min(least, value);
    largest = std::max(largest, value);
  }
};

// Numbers the groups of all elements, in the order of `key_of(element)`.
template <typename KeyOf>
std::vector<int> numbered(size_t num_elements, const KeyOf& key_of) {
  std::map<decltype(key_of(0)), int> number;
  for (size_t i = 0; i < num_elements; ++i) number[key_of(i)] = 0;
  int next = 0;
  for (auto& [key, group] : number) group = next++;
  std::vector<int> groups(num_elements);
  for (size_t i = 0; i < num_elements; ++i) groups[i] = number.at(key_of(i));
  return groups;
}

int num_groups(const std::vector<int>& groups) {
  return groups.empty() ? 0 : 1 + *std::max_element(groups.begin(), groups.end());
}

// Gives each group the middles of its values, and notes how far they are from the values at its ends.
void set_values(std::span<const double> young, std::span<const double> nu, ElementModuli& moduli) {
  std::vector<Range> of_young(static_cast<size_t>(num_groups(moduli.group_of_element)));
  std::vector<Range> of_nu(of_young.size());
  for (size_t i = 0; i < young.size(); ++i) {
    const auto group = static_cast<size_t>(moduli.group_of_element[i]);
    of_young[group].extend(young[i]);
    of_nu[group].extend(nu[i]);
  }
  for (size_t group = 0; group < of_young.size(); ++group) {
    // The geometric mean of the ends changes both by the same factor. Equal ends stay exact.
    const auto [least, largest] = of_young[group];
    const double middle = least == largest ? least : least * std::sqrt(largest / least);
    const double middle_nu = of_nu[group].least + (of_nu[group].largest - of_nu[group].least) / 2;
    moduli.groups.push_back({middle, middle_nu});
    moduli.largest_change = std::max(moduli.largest_change, middle / least - 1);
    moduli.largest_nu_change = std::max(moduli.largest_nu_change, of_nu[group].largest - middle_nu);
  }
}

}  // namespace

ElementModuli find_element_moduli(const MeshData& mesh, double young, double nu) {
  ElementModuli moduli;
  std::vector<double> all_young = values_of_elements(mesh, "E", moduli.notes);
  std::vector<double> all_nu = values_of_elements(mesh, "NU", moduli.notes);
  if (all_young.empty() && all_nu.empty()) return moduli;
  moduli.has_young = !all_young.empty();
  moduli.has_nu = !all_nu.empty();
  require(
      mesh, all_young, [](double value) { return value > 0 && std::isfinite(value); }, "E",
      "Young's modulus must be above 0; correct it, or rename an array that means something else");
  require(
      mesh, all_nu, [](double value) { return value >= 0 && value <= kLargestRatio; }, "nu",
      fmt::format("Poisson's ratio must lie in 0 .. {:g}; correct it, with 0.49 for soft tissue",
                  kLargestRatio));
  all_young.resize(std::max(all_young.size(), all_nu.size()), young);
  all_nu.resize(all_young.size(), nu);
  moduli.group_of_element =
      numbered(all_young.size(), [&](size_t i) { return std::pair(all_young[i], all_nu[i]); });
  constexpr double kFirstStep = 1.05;
  constexpr double kWiden = 1.25;  // power of the step when there are still too many groups
  for (double ratio = kFirstStep; num_groups(moduli.group_of_element) > kMostModuli;
       ratio = std::pow(ratio, kWiden)) {
    moduli.group_of_element = numbered(all_young.size(), [&](size_t i) {
      return std::pair(step_of(all_young[i], ratio), -step_of(0.5 - all_nu[i], ratio));
    });
  }
  set_values(all_young, all_nu, moduli);
  return moduli;
}

void labels_to_sets(MeshData& mesh) {
  for (const MeshArray& array : mesh.cell_arrays) {
    const std::string name = normalised_name(array.name);
    if (name.empty() || name == "E" || name == "NU" || !has_integers(array)) continue;
    std::map<long, std::vector<int>> members;
    for (size_t i = 0; i < mesh.cells.size() && members.size() <= kMostModuli; ++i) {
      if (mesh.cells[i].kind == CellKind::tetrahedron)
        members[static_cast<long>(array.values[i])].push_back(static_cast<int>(i));
    }
    if (members.size() < 2 || members.size() > kMostModuli) continue;
    for (auto& [value, cells] : members)
      mesh.element_sets.try_emplace(fmt::format("{}_{}", name, value), std::move(cells));
  }
}

}  // namespace palpate
