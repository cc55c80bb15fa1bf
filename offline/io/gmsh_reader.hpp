// Reads the sections of a Gmsh file into a draft. gmsh_elements.cpp reads $Elements.
#pragma once

#include <cmath>
#include <compare>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "offline/io/file_number.hpp"
#include "offline/io/gmsh_draft.hpp"

namespace palpate {

// The numbers of a Gmsh file, as text or binary.
class GmshNumbers {
 public:
  explicit GmshNumbers(FileCursor& in) : in_(in) {}

  NumberCoding coding = NumberCoding::text;

  bool is_binary() const { return coding != NumberCoding::text; }

  // A number with 4 bytes in a binary file.
  int integer(const char* what) { return next_index(in_, NumberType::int32, coding, what); }

  // A number with 8 bytes in a binary file: a label or a count of format 4.1.
  int wide(const char* what) { return next_index(in_, NumberType::uint64, coding, what); }

  // A count of items that take at least `text_bytes` or `binary_bytes` each.
  std::size_t wide_count(const char* what, std::size_t text_bytes, std::size_t binary_bytes) {
    return in_.check_count(wide(what), what, is_binary() ? binary_bytes : text_bytes);
  }

  // A count in text, even in a binary file, and the end of its line.
  std::size_t text_count(const char* what, std::size_t text_bytes, std::size_t binary_bytes) {
    const std::size_t count = in_.next_count(what, is_binary() ? binary_bytes : text_bytes);
    end_line(what);
    return count;
  }

  // Passes the end of a line of text before binary numbers.
  void end_line(const char* what) {
    if (is_binary()) in_.next_line(what);
  }

  double real(const char* what) {
    if (!is_binary()) return in_.next_number(what);
    const double number = palpate::next_number(in_, NumberType::float64, coding, what);
    if (!std::isfinite(number))
      in_.fail(std::string(what) + " is " + (std::isnan(number) ? "NaN" : "infinite") +
               "; export the file again");
    return number;
  }

 private:
  FileCursor& in_;
};

class GmshReader {
 public:
  GmshReader(Pass pass, FileCursor& in) : in_(in), numbers_(in), draft_(pass, in) {}
  MeshData read();

 private:
  // An elementary entity, whose physical groups stand in `groups_`. A damaged file may have nothing but
  // entities, so that they are small, and in a deque, which grows without a copy.
  struct Entity {
    int dimension, number;
    std::uint32_t first_group, num_groups;
    auto operator<=>(const Entity&) const = default;
  };

  void read_section();
  void read_format();
  void read_names();
  void read_entities(bool partitioned);
  void read_entity(int dimension, bool partitioned);
  std::vector<int> groups_of(int dimension, int number) const;  // of sorted entities
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
  std::deque<Entity> entities_;  // with groups
  std::deque<int> groups_;       // of one entity after the other
};

}  // namespace palpate
