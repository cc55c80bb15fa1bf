// Reads the arrays of legacy VTK files: SCALARS, VECTORS, FIELD and the like.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "offline/io/file_cursor.hpp"
#include "offline/io/file_number.hpp"
#include "offline/io/mesh_data.hpp"

namespace palpate {

std::string upper_case(std::string_view text);

// Names of arrays have no blanks: "Young%20modulus".
std::string decoded_vtk_name(std::string_view name);
std::string encoded_vtk_name(std::string_view name);

class VtkAttributes {
 public:
  explicit VtkAttributes(FileCursor& cursor) : cursor_(cursor) {}

  void set_coding(NumberCoding coding) { coding_ = coding; }

  // Reads the section behind `keyword` and adds its arrays, with `size` values each times their components.
  // Arrays of a FIELD state a size of their own. Strings and bits are passed over. Returns false if it does
  // not know the keyword.
  bool read(const std::string& keyword, std::size_t size, std::vector<MeshArray>& arrays);

  // Passes the lines up to an empty one.
  void skip_metadata();

  NumberType next_type();

  // Passes the end of the line before the numbers.
  void end_header();

 private:
  void read_scalars(std::size_t size, std::vector<MeshArray>& arrays);
  void read_colours(std::size_t size, std::vector<MeshArray>& arrays);
  void read_field(std::vector<MeshArray>& arrays);
  void skip_lookup_table();
  void skip_bits(std::size_t count);
  void skip_strings(std::size_t count);
  std::string next_name();
  int next_num_components(const char* what);
  std::vector<double> next_values(std::size_t count, NumberType type, const std::string& name);

  FileCursor& cursor_;
  NumberCoding coding_ = NumberCoding::text;
};

}  // namespace palpate
