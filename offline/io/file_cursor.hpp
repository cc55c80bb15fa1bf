// Reads the bytes of a mesh file from front to back, as text or as binary numbers. Every read is checked: a
// damaged file ends in an InputError with file, place and remedy.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "offline/io/mesh_data.hpp"

namespace palpate {

class FileCursor {
 public:
  // Reads the whole file. Skips a byte order mark. Throws InputError if the file cannot be read.
  explicit FileCursor(const std::filesystem::path& file);

  // A file whose bytes are in memory. `line`: of the first byte.
  FileCursor(std::string file, int line, std::string bytes);

  // A part of `whole`, such as an array, whose bytes stay where they are. `line`: where it begins.
  FileCursor(const FileCursor& whole, int line, std::string_view part);

  FileCursor(const FileCursor&) = delete;
  FileCursor& operator=(const FileCursor&) = delete;

  // Goes back to the first byte.
  void rewind();

  // Moves all bytes out.
  std::string take_bytes();

  const std::string& file() const { return file_; }
  int line() const { return line_; }  // of the next byte, from 1; counts the line ends read as text
  std::size_t num_left() const { return bytes_.size() - at_; }
  bool at_end() const { return at_ == bytes_.size(); }

  // Throw InputError. The message ends with a remedy: "...; export the file again". The place is the line, or
  // behind binary numbers, among which lines have no meaning, the byte. Line 0: the file as a whole.
  [[noreturn]] void fail(const std::string& message) const;
  [[noreturn]] void fail_at(int line, const std::string& message) const;

  // Fails since `word` is no number, or no integer.
  [[noreturn]] void fail_number(std::string_view word, bool is_integer, const char* what) const;

  // Fails where the rest of the file is too short for `count` items of at least `least_bytes`, or count is
  // negative.
  std::size_t check_count(int count, const char* what, std::size_t least_bytes) const;

  // Returns the next line without its end, LF, CRLF or CR, and passes it. Fails at the end of the file.
  std::string_view next_line(const char* what);

  // From here on, text from a word that begins with `first` to the end of its line is a comment. The
  // functions below pass comments and give each to `read`, if there is one.
  void set_comment(char first, std::function<void(std::string_view)> read = {});

  // Passes blanks, line ends and comments. Whether text is left.
  bool skip_blanks();

  // Passes blanks within the line. Whether a word is left in the line.
  bool has_word_in_line();

  // Passes everything up to and with the first of two words between blanks, even binary numbers. Passes
  // nothing and returns false where the rest of the file lacks both. The words begin with one letter.
  bool skip_past_word(std::string_view word, std::string_view other);

  // Returns the next word, without blanks around it. `what` names the word in the message of a failure:
  // "the file ends where <what> should be".
  std::string_view next_word(const char* what);

  // Returns the next word without passing it; empty at the end.
  std::string_view peek_word();

  // Returns the next word as a number. Numbers may have Fortran's exponent; infinity and NaN are refused.
  int next_integer(const char* what);
  double next_number(const char* what);

  // Returns the next word as a count, after check_count().
  std::size_t next_count(const char* what, std::size_t least_bytes);

  // Passes `count` bytes and returns them.
  std::string_view next_bytes(std::size_t count, const char* what);

  // Returns the next `count` bytes without passing them, or fewer at the end.
  std::string_view peek_bytes(std::size_t count) const { return bytes_.substr(at_, count); }

  // Returns the next binary number. `is_big`: the file has its most significant byte first.
  template <typename Number>
  Number next_binary(bool is_big, const char* what) {
    static_assert(std::is_arithmetic_v<Number>);
    const std::string_view from = next_bytes(sizeof(Number), what);
    unsigned char bytes[sizeof(Number)];
    std::memcpy(bytes, from.data(), sizeof bytes);
    if (is_big == (std::endian::native == std::endian::little)) {
      for (std::size_t i = 0; i < sizeof bytes / 2; ++i) std::swap(bytes[i], bytes[sizeof bytes - 1 - i]);
    }
    Number number;
    std::memcpy(&number, bytes, sizeof number);
    return number;
  }

 private:
  void pass_to(std::size_t end);
  void skip_line_end();

  std::string file_;
  std::string owned_;  // empty in a part of another file
  std::string_view bytes_;
  bool is_part_ = false;
  bool has_binary_ = false;  // binary numbers were read
  std::size_t at_ = 0, first_ = 0;
  int line_ = 1, first_line_ = 1;
  char comment_ = 0;
  std::function<void(std::string_view)> read_comment_;
};

// A reader passes its files twice. The first pass looks for damage and builds no mesh. It keeps only what
// later checks need: runs of labels, ends of cells, Gmsh's entities. The second pass builds the mesh.
enum class Pass : std::uint8_t { check, build };

template <typename Reader, typename... Cursors>
MeshData read_twice(Cursors&... cursors) {
  Reader(Pass::check, cursors...).read();
  (cursors.rewind(), ...);
  return Reader(Pass::build, cursors...).read();
}

}  // namespace palpate
