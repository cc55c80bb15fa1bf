// Reads the bytes of a mesh file from front to back, as text or as binary numbers. Every read is checked: a
// damaged file ends in an InputError with file, line and remedy, and never in more memory than the file has.
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

namespace palpate {

class FileCursor {
 public:
  // Reads the whole file. Skips a byte order mark. Throws InputError if the file cannot be read.
  explicit FileCursor(const std::filesystem::path& file);

  // Bytes behind a part of a file, such as a decoded array. `line`: where the part stands in `file`.
  FileCursor(std::string file, int line, std::string bytes);

  const std::string& file() const { return file_; }
  int line() const { return line_; }  // of the next byte, from 1; counts the line ends read as text
  std::size_t num_left() const { return bytes_.size() - at_; }
  bool at_end() const { return at_ == bytes_.size(); }

  // Throws InputError at the current line. The message ends with a remedy: "...; export the file again".
  [[noreturn]] void fail(const std::string& message) const;
  [[noreturn]] void fail_at(int line, const std::string& message) const;

  // Returns the next line without its end, LF, CRLF or CR, and passes it. Fails at the end of the file.
  std::string_view next_line(const char* what);

  // From here on, text from a word that begins with `first` to the end of its line is a comment. The
  // functions below pass comments and give each to `read`, if there is one.
  void set_comment(char first, std::function<void(std::string_view)> read = {});

  // Passes blanks, line ends and comments. `comment`: the first letter of further comments. Whether text is
  // left.
  bool skip_blanks(char comment = 0);

  // Passes everything up to and with `word` between blanks, even binary numbers. Passes nothing and
  // returns false where the rest of the file lacks it.
  bool skip_past_word(std::string_view word);

  // Returns the next word, without blanks around it. `what` names the word in the message of a failure:
  // "the file ends where <what> should be".
  std::string_view next_word(const char* what);

  // Returns the next word without passing it; empty at the end.
  std::string_view peek_word();

  // Returns the next word as a number. Numbers may have Fortran's exponent; infinity and NaN are refused.
  int next_integer(const char* what);
  double next_number(const char* what);

  // Returns the next word as a count of items that take at least `least_bytes` each. Refuses a negative count
  // and a count for which the rest of the file is too short.
  std::size_t next_count(const char* what, std::size_t least_bytes);

  // Passes `count` bytes and returns them.
  std::string_view next_bytes(std::size_t count, const char* what);

  // Returns the next `count` bytes without passing them, or fewer at the end.
  std::string_view peek_bytes(std::size_t count) const { return std::string_view(bytes_).substr(at_, count); }

  // Passes the single line end before binary data.
  void skip_line_end();

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
  std::string file_;
  std::string bytes_;
  std::size_t at_ = 0;
  int line_ = 1;
  char comment_ = 0;
  std::function<void(std::string_view)> read_comment_;
};

}  // namespace palpate
