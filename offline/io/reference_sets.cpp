#include "offline/io/reference_sets.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <stdexcept>

#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

constexpr std::string_view kCommentStart = "# reference ";

// Each member of a reference joins all its sets, so their number bounds the memory that a damaged file can
// take.
constexpr std::size_t kMostNames = 100;

void add_name(std::string_view name, std::vector<std::string>& names) {
  if (names.size() < kMostNames) names.emplace_back(name);
}

// Adds the members of each reference to the sets with its names.
void fill_sets(const std::map<int, std::vector<int>>& members,
               const std::map<int, std::vector<std::string>>& names, const std::string& prefix,
               std::map<std::string, std::vector<int>>& sets) {
  for (const auto& [reference, items] : members) {
    const auto named = names.find(reference);
    const std::vector<std::string> unnamed = {prefix + std::to_string(reference)};
    for (const std::string& name : named == names.end() ? unnamed : named->second) {
      std::vector<int>& set = sets[name];
      set.insert(set.end(), items.begin(), items.end());
    }
  }
  sort_sets(sets);
}

// Returns the number of a combination that is the one set REF_number.
std::optional<int> number_in_name(const std::vector<std::string>& names, const std::string& prefix) {
  if (names.size() != 1 || !names[0].starts_with(prefix)) return std::nullopt;
  const std::optional<int> number = parse_integer(std::string_view(names[0]).substr(prefix.size()));
  if (!number || *number == 0 || prefix + std::to_string(*number) != names[0]) return std::nullopt;
  return number;
}

}  // namespace

SetCombinations combine_sets(const std::map<std::string, std::vector<int>>& sets, std::size_t num_items) {
  SetCombinations found;
  found.of_item.assign(num_items, 0);
  found.names.emplace_back();
  for (const auto& [name, items] : sets) {
    std::map<int, int> with_name;  // combination before this set -> combination with it
    for (const int item : items) {
      int& combination = found.of_item[static_cast<std::size_t>(item)];
      const auto [at, is_new] = with_name.try_emplace(combination, static_cast<int>(found.names.size()));
      if (is_new) {
        std::vector<std::string> names = found.names[static_cast<std::size_t>(combination)];
        names.push_back(name);
        found.names.push_back(std::move(names));
      }
      combination = at->second;
    }
  }
  return found;
}

void ReferenceSets::read_comment(std::string_view comment) {
  if (!comment.starts_with(kCommentStart)) return;
  comment.remove_prefix(kCommentStart.size());
  const std::optional<int> reference = parse_integer(comment.substr(0, comment.find(' ')));
  const std::size_t of = comment.find(" of ");
  const std::size_t colon = comment.find(": ");
  if (!reference || of == std::string_view::npos || colon == std::string_view::npos || colon < of) return;
  const std::string_view items = comment.substr(of + 4, colon - of - 4);
  const std::string_view name = trimmed(comment.substr(colon + 2));
  if (name.empty()) return;
  if (items == "nodes") add_name(name, node_names_[*reference]);
  if (items == "cells") add_name(name, cell_names_[*reference]);
}

void ReferenceSets::add_node(int reference, int node) {
  if (reference != 0) nodes_[reference].push_back(node);
}

void ReferenceSets::add_cell(int reference, int cell) {
  if (reference != 0) cells_[reference].push_back(cell);
}

void ReferenceSets::add_face(int reference, int cell, const std::vector<int>& nodes) {
  add_cell(reference, cell);
  if (reference == 0) return;
  std::vector<int>& of_faces = face_nodes_[reference];
  of_faces.insert(of_faces.end(), nodes.begin(), nodes.end());
}

void ReferenceSets::fill(MeshData& mesh) const {
  fill_sets(nodes_, node_names_, node_prefix_, mesh.node_sets);
  fill_sets(cells_, cell_names_, cell_prefix_, mesh.element_sets);
  const bool are_named = !node_names_.empty() || !cell_names_.empty();
  if (!are_named) fill_sets(face_nodes_, {}, cell_prefix_, mesh.node_sets);
}

WrittenReferences number_references(const std::map<std::string, std::vector<int>>& sets,
                                    std::size_t num_items, const char* items, const std::string& prefix) {
  const SetCombinations combinations = combine_sets(sets, num_items);
  std::vector<int> numbers(combinations.names.size(), 0);
  std::set<int> taken;
  for (std::size_t i = 1; i < numbers.size(); ++i) {
    if (const auto number = number_in_name(combinations.names[i], prefix)) taken.insert(numbers[i] = *number);
  }
  std::vector<char> is_used(numbers.size(), 0);
  for (const int combination : combinations.of_item) is_used[static_cast<std::size_t>(combination)] = 1;

  WrittenReferences written;
  int next = 1;
  for (std::size_t i = 1; i < numbers.size(); ++i) {
    if (!is_used[i]) continue;
    if (numbers[i] == 0) {
      while (taken.contains(next)) ++next;
      numbers[i] = next++;
    }
    for (const std::string& name : combinations.names[i]) {
      if (name.find_first_of("\n\r") != std::string::npos || trimmed(name) != name || name.empty())
        throw std::runtime_error("the file cannot hold the set '" + printable(name) + "'; rename it");
      written.comments +=
          std::string(kCommentStart) + std::to_string(numbers[i]) + " of " + items + ": " + name + "\n";
    }
  }
  for (const int combination : combinations.of_item)
    written.of_item.push_back(numbers[static_cast<std::size_t>(combination)]);
  return written;
}

}  // namespace palpate
