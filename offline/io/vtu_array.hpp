// The values of an array in a VTU file: text, or bytes that may be base64 and may be compressed by zlib.
//
//   uncompressed:  [bytes] values
//   compressed:    [blocks][bytes of a block][bytes of the last block][compressed bytes of each block] blocks
//
// Numbers in brackets take four or eight bytes; a last block of 0 bytes is whole. In base64 the header of a
// compressed array is coded on its own.
// Source: https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "offline/io/file_cursor.hpp"
#include "offline/io/file_number.hpp"

namespace palpate {

// How the file stores the bytes of its arrays.
struct VtuCoding {
  NumberCoding numbers = NumberCoding::little_endian;
  std::size_t header_bytes = 4;
  bool is_compressed = false;
};

// An array of the file, for its messages.
struct VtuArrayPlace {
  const FileCursor& cursor;
  int line;
  std::string name;

  [[noreturn]] void fail(const std::string& message) const;
};

// Gives the `num_bytes` bytes of an array that begins at the start of `stored` to `take`, in blocks of whole
// numbers, so that no array stands in memory. `growth_left`: bytes that the file's binary arrays may
// still grow to, so that a small file cannot fill the memory.
void decode_vtu_array(std::string_view stored, bool is_base64, const VtuCoding& coding, std::size_t num_bytes,
                      std::size_t& growth_left, const VtuArrayPlace& place,
                      const std::function<void(std::string_view block)>& take);

}  // namespace palpate
