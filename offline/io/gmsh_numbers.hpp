// The numbers of a Gmsh file, as text or binary.
#pragma once

#include <climits>
#include <cmath>
#include <cstdint>
#include <string>

#include "offline/io/file_cursor.hpp"

namespace palpate {

class GmshNumbers {
 public:
  explicit GmshNumbers(FileCursor& in) : in_(in) {}

  bool is_binary = false;
  bool is_big = false;  // the most significant byte first

  // A number with 4 bytes in a binary file.
  int integer(const char* what) {
    return is_binary ? in_.next_binary<std::int32_t>(is_big, what) : in_.next_integer(what);
  }

  // A number with 8 bytes in a binary file: a label or a count of format 4.1.
  int wide(const char* what) {
    if (!is_binary) return in_.next_integer(what);
    const auto number = in_.next_binary<std::uint64_t>(is_big, what);
    if (number > INT_MAX)
      in_.fail(std::string(what) + " is " + std::to_string(number) +
               ", above 2147483647; renumber the mesh, or export it again");
    return static_cast<int>(number);
  }

  // A count of items that take at least `text_bytes` or `binary_bytes` each.
  std::size_t wide_count(const char* what, std::size_t text_bytes, std::size_t binary_bytes) {
    if (!is_binary) return in_.next_count(what, text_bytes);
    const auto count = static_cast<std::size_t>(wide(what));
    if (count > in_.num_left() / binary_bytes)
      in_.fail(std::string(what) + " is " + std::to_string(count) +
               ", more than the rest of the file holds; export it again");
    return count;
  }

  // A count in text, even in a binary file, and the end of its line.
  std::size_t text_count(const char* what, std::size_t text_bytes, std::size_t binary_bytes) {
    const std::size_t count = in_.next_count(what, is_binary ? binary_bytes : text_bytes);
    if (is_binary) in_.next_line(what);
    return count;
  }

  double real(const char* what) {
    if (!is_binary) return in_.next_number(what);
    const auto number = in_.next_binary<double>(is_big, what);
    if (!std::isfinite(number))
      in_.fail(std::string(what) + " is " + (std::isnan(number) ? "NaN" : "infinite") +
               "; export the file again");
    return number;
  }

 private:
  FileCursor& in_;
};

}  // namespace palpate
