// Sets in formats that give a point or a cell one number, a reference, and have no names.
//
// A writer numbers each combination of sets and tells the names in comments, which other programs skip:
//   # reference 3 of nodes: FIXED
// Without such a comment the reference becomes a set such as REF_3. Reference 0 means no set.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "offline/io/mesh_data.hpp"

namespace palpate {

// Which sets each point or cell is in, as one number.
struct SetCombinations {
  std::vector<int> of_item;                     // index in `names` for each point or cell
  std::vector<std::vector<std::string>> names;  // of the sets of a combination, sorted; the first has no sets
};

// `sets`: as in MeshData, with indices below `num_items`.
SetCombinations combine_sets(const std::map<std::string, std::vector<int>>& sets, std::size_t num_items);

class ReferenceSets {
 public:
  // `node_prefix`: "REF_" of the sets REF_1, REF_2, ...
  ReferenceSets(std::string node_prefix, std::string cell_prefix)
      : node_prefix_(std::move(node_prefix)), cell_prefix_(std::move(cell_prefix)) {}

  void read_comment(std::string_view comment);
  void add_node(int reference, int node);
  void add_cell(int reference, int cell);
  // The cell also gives its nodes to a node set, unless comments name the sets.
  void add_face(int reference, int cell, const std::vector<int>& nodes);
  void fill(MeshData& mesh) const;

 private:
  using Members = std::map<int, std::vector<int>>;  // reference -> indices
  using Names = std::map<int, std::vector<std::string>>;

  std::string node_prefix_;
  std::string cell_prefix_;
  Names node_names_;
  Names cell_names_;
  Members nodes_;
  Members cells_;
  Members face_nodes_;
};

struct WrittenReferences {
  std::vector<int> of_item;
  std::string comments;  // lines
};

// `items`: "nodes" or "cells". A set called `prefix` and a number keeps this number where it can.
WrittenReferences number_references(const std::map<std::string, std::vector<int>>& sets,
                                    std::size_t num_items, const char* items, const std::string& prefix);

}  // namespace palpate
