// The numbers of a Gmsh file, as text or binary.
#pragma once

#include <cmath>
#include <string>

#include "offline/io/file_number.hpp"

namespace palpate {

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

}  // namespace palpate
