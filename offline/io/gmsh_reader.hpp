// Reads the sections of a Gmsh file into a draft. gmsh_elements.cpp reads $Elements.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "offline/io/gmsh_draft.hpp"
#include "offline/io/gmsh_numbers.hpp"

namespace palpate {

class GmshReader {
 public:
  GmshReader(Pass pass, FileCursor& in) : in_(in), numbers_(in), draft_(pass, in) {}
  MeshData read();

 private:
  void read_section();
  void read_format();
  void read_names();
  void read_entities(bool partitioned);
  void read_entity(int dimension, bool partitioned);
  void read_nodes(bool parametric);
  void read_node_blocks();
  void read_node_block(std::size_t count, int dimension, bool parametric);
  void read_elements();  // of format 1 and 2
  void read_binary_elements(std::size_t count);
  void read_element_blocks();  // of format 4.1
  void read_element_block(std::size_t count, const GmshType& type, int entity,
                          const std::vector<int>& groups);
  void read_data(bool of_cells);
  MeshArray read_data_header(std::size_t& count);
  const GmshType& type_of(int number) const;
  void read_labels(GmshElement& element, bool wide);
  void skip_section(const std::string& name);
  void end_section(const std::string& end);
  void expect_total(std::size_t found, std::size_t stated, const char* items) const;

  FileCursor& in_;
  GmshNumbers numbers_;
  GmshDraft draft_;
  int version_ = 1;  // 1, 2 or 4
  int section_line_ = 0;
  // (dimension, number) of an elementary entity -> its physical groups
  std::map<std::pair<int, int>, std::vector<int>> groups_of_entity_;
};

}  // namespace palpate
