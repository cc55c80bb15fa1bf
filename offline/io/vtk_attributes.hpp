// Reads the arrays of legacy VTK files: SCALARS, VECTORS, FIELD and the like.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

#include "offline/io/file_cursor.hpp"
#include "offline/io/file_number.hpp"
#include "offline/io/mesh_data.hpp"

namespace palpate {

// Names of arrays have no blanks: "Young%20modulus".
std::string decoded_vtk_name(std::string_view name);
std::string encoded_vtk_name(std::string_view name);

class VtkAttributes {
 public:
  VtkAttributes(Pass pass, FileCursor& cursor) : cursor_(cursor), keeps_(pass == Pass::build) {}

  void set_coding(NumberCoding coding) { coding_ = coding; }

  // Reads the section behind `keyword`. Gives each array to `take`, with `num_rows` rows; in the first pass
  // without values. Arrays of a FIELD state the number of rows. Strings and bits are passed over. Returns
  // false if it does not know the keyword.
  using Take = std::function<void(MeshArray array, std::size_t num_rows)>;
  bool read(const std::string& keyword, std::size_t num_rows, const Take& take);

  // Passes the lines up to an empty one.
  void skip_metadata();

  // Passes the end of the line before the numbers.
  void end_header();

 private:
  void read_array(std::string name, int num_components, std::size_t num_rows, NumberType type,
                  const Take& take);
  void read_scalars(std::size_t num_rows, const Take& take);
  void read_field(const Take& take);
  void skip_lookup_table();
  void skip_bits(std::size_t count);
  void skip_strings(std::size_t count);
  std::string next_name();
  int next_num_components(const char* what);

  FileCursor& cursor_;
  const bool keeps_;
  NumberCoding coding_ = NumberCoding::text;
};

}  // namespace palpate
