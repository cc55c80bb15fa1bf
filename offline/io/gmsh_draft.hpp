// A mesh while a Gmsh file is read: labels and physical groups are still numbers.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "offline/io/file_cursor.hpp"
#include "offline/io/gmsh_cells.hpp"
#include "offline/io/label_index.hpp"
#include "offline/io/mesh_data.hpp"

namespace palpate {

// An element as it stands in a file.
struct GmshElement {
  const GmshType* type = nullptr;
  int label = 0;
  int line = 0;                                 // 0 in a binary file
  int entity = 0;                               // number of the elementary entity
  std::span<const int> groups;                  // numbers of the physical groups; 0: none
  std::array<int, kMostGmshNodes> labels = {};  // of the nodes
};

class GmshDraft {
 public:
  using GroupKey = std::pair<int, std::int64_t>;  // (dimension, number of the physical group)

  // In the first pass the draft keeps labels alone.
  GmshDraft(Pass pass, const FileCursor& in) : in_(in), keeps_(pass == Pass::build) {
    mesh_.file = in.file();
  }

  void add_name(int dimension, std::int64_t number, std::string name) {
    names_[{dimension, number}] = std::move(name);
  }
  void add_node(int label, const Eigen::Vector3d& position);
  void end_nodes(int line);
  bool has_nodes() const { return has_nodes_; }

  void add_element(const GmshElement& element);
  void end_elements(int line);
  bool has_elements() const { return has_elements_; }

  // Return the index of a point or a cell. A cell that became a node of a set has the index -1.
  int find_node(int label) const;
  int find_cell(int label) const;
  bool keeps() const { return keeps_; }
  std::size_t num_points() const { return static_cast<std::size_t>(num_points_); }
  std::size_t num_cells() const { return static_cast<std::size_t>(num_cells_); }
  void add_array(bool of_cells, MeshArray array);  // replaces an array of the same name
  void add_note(std::string note) { mesh_.notes.push_back(std::move(note)); }

  MeshData finish();

 private:
  struct Group {
    std::vector<int> nodes;
    std::vector<int> cells;
  };

  bool repeats_last(const GmshElement& element, const MeshCell& cell) const;
  std::string name_of(const GroupKey& key) const;

  const FileCursor& in_;
  const bool keeps_;
  MeshData mesh_;
  int num_points_ = 0;
  int num_cells_ = 0;
  std::map<GroupKey, std::string> names_;
  std::map<GroupKey, Group> groups_;
  std::map<const GmshType*, std::size_t> num_truncated_;
  LabelIndex nodes_;
  LabelIndex cells_;
  bool has_nodes_ = false;
  bool has_elements_ = false;
  MeshCell last_cell_;
  int last_entity_ = 0;
  int last_group_ = 0;
};

}  // namespace palpate
