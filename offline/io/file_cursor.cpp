#include "offline/io/file_cursor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "offline/mesh/input_error.hpp"
#include "offline/mesh/text_file.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

bool is_line_end(char letter) {
  return letter == '\n' || letter == '\r';
}

bool is_blank(char letter) {
  return letter == ' ' || letter == '\t' || letter == '\v' || letter == '\f' || is_line_end(letter);
}

}  // namespace

FileCursor::FileCursor(const std::filesystem::path& file) : file_(file.string()) {
  if (const std::string complaint = read_text_file(file, owned_); !complaint.empty())
    throw InputError({file_, 0}, complaint);
  bytes_ = owned_;
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (bytes_.starts_with(kByteOrderMark)) at_ = first_ = kByteOrderMark.size();
  if (at_end()) throw InputError({file_, 0}, "is empty; copy or export it again");
}

FileCursor::FileCursor(std::string file, int line, std::string bytes)
    : file_(std::move(file)), owned_(std::move(bytes)), bytes_(owned_), line_(line), first_line_(line) {}

FileCursor::FileCursor(const FileCursor& whole, int line, std::string_view part)
    : file_(whole.file_), bytes_(part), is_part_(true), line_(line), first_line_(line) {}

void FileCursor::rewind() {
  at_ = first_;
  line_ = first_line_;
  has_binary_ = false;
}

std::string FileCursor::take_bytes() {
  bytes_ = {};
  at_ = 0;
  return std::move(owned_);
}

void FileCursor::fail(const std::string& message) const {
  fail_at(line_, message);
}

void FileCursor::fail_at(int line, const std::string& message) const {
  if (line > 0 && has_binary_ && !is_part_)
    throw InputError({file_, 0}, "byte " + std::to_string(at_) + ": " + message);
  throw InputError({file_, line}, message);
}

void FileCursor::fail_number(std::string_view word, bool is_integer, const char* what) const {
  const std::string where = std::string(", where ") + what + " should be; ";
  const std::optional<double> number = parse_number(word);
  if (is_integer && number && std::abs(*number) > std::numeric_limits<int>::max())
    fail(printable(word) + " is beyond 2147483647" + where + "renumber the mesh, or export it again");
  const bool has_comma = word.find(',') != std::string_view::npos;
  fail("'" + printable(word) + (is_integer ? "' is no integer" : "' is no number") + where +
       (has_comma ? "write decimals with a point, and blanks between numbers" : "correct it"));
}

std::size_t FileCursor::check_count(int count, const char* what, std::size_t least_bytes) const {
  if (count < 0) fail(std::string(what) + " is negative; export the file again");
  const auto size = static_cast<std::size_t>(count);
  if (least_bytes > 0 && size > num_left() / least_bytes)
    fail(std::string(what) + " is " + std::to_string(count) +
         ", more than the rest of the file holds; export it again");
  return size;
}

std::string_view FileCursor::next_line(const char* what) {
  if (at_end()) fail(std::string("the file ends where ") + what + " should be; export it again");
  const std::size_t begin = at_;
  while (at_ < bytes_.size() && !is_line_end(bytes_[at_])) ++at_;
  const std::string_view line = bytes_.substr(begin, at_ - begin);
  skip_line_end();
  return line;
}

void FileCursor::set_comment(char first, std::function<void(std::string_view)> read) {
  comment_ = first;
  read_comment_ = std::move(read);
}

bool FileCursor::skip_blanks() {
  for (;;) {
    std::size_t end = at_;
    while (end < bytes_.size() && is_blank(bytes_[end])) ++end;
    pass_to(end);
    if (at_end()) return false;
    if (comment_ == 0 || bytes_[at_] != comment_) return true;
    const std::string_view text = next_line("a comment");
    if (read_comment_) read_comment_(text);
  }
}

bool FileCursor::has_word_in_line() {
  while (!at_end() && is_blank(bytes_[at_]) && !is_line_end(bytes_[at_])) ++at_;
  return !at_end() && !is_line_end(bytes_[at_]) && (comment_ == 0 || bytes_[at_] != comment_);
}

bool FileCursor::skip_past_word(std::string_view word, std::string_view other) {
  const auto stands_at = [&](std::size_t at, std::string_view sought) {
    const std::size_t end = at + sought.size();
    return bytes_.substr(at).starts_with(sought) && (end == bytes_.size() || is_blank(bytes_[end]));
  };
  for (std::size_t found = bytes_.find(word.front(), at_); found != std::string::npos;
       found = bytes_.find(word.front(), found + 1)) {
    if (found > 0 && !is_blank(bytes_[found - 1])) continue;
    if (!stands_at(found, word) && !stands_at(found, other)) continue;
    pass_to(found + (stands_at(found, word) ? word : other).size());
    return true;
  }
  return false;
}

std::string_view FileCursor::peek_word() {
  skip_blanks();
  std::size_t end = at_;
  while (end < bytes_.size() && !is_blank(bytes_[end])) ++end;
  return bytes_.substr(at_, end - at_);
}

std::string_view FileCursor::next_word(const char* what) {
  const std::string_view word = peek_word();
  if (word.empty()) fail(std::string("the file ends where ") + what + " should be; export it again");
  at_ += word.size();
  return word;
}

int FileCursor::next_integer(const char* what) {
  const std::string_view word = next_word(what);
  const std::optional<int> number = parse_integer(word);
  if (!number) fail_number(word, true, what);
  return *number;
}

double FileCursor::next_number(const char* what) {
  const std::string_view word = next_word(what);
  const std::optional<double> number = parse_number(word);
  if (!number) fail_number(word, false, what);
  return *number;
}

std::size_t FileCursor::next_count(const char* what, std::size_t least_bytes) {
  return check_count(next_integer(what), what, least_bytes);
}

std::string_view FileCursor::next_bytes(std::size_t count, const char* what) {
  has_binary_ = true;
  if (count > num_left())
    fail(std::string("the file ends within ") + what + "; copy or export it again, in binary");
  const std::string_view bytes = bytes_.substr(at_, count);
  at_ += count;
  return bytes;
}

void FileCursor::pass_to(std::size_t end) {
  while (at_ < end) {
    if (is_line_end(bytes_[at_])) {
      skip_line_end();
    } else {
      ++at_;
    }
  }
}

// Passes LF, CRLF or CR, if the next byte begins one.
void FileCursor::skip_line_end() {
  if (at_end()) return;
  const bool is_return = bytes_[at_] == '\r';
  ++at_;
  if (is_return && !at_end() && bytes_[at_] == '\n') ++at_;
  ++line_;
}

}  // namespace palpate
