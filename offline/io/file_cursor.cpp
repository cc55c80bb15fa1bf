#include "offline/io/file_cursor.hpp"

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
  if (const std::string complaint = read_text_file(file, bytes_); !complaint.empty())
    throw InputError({file_, 0}, complaint);
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (bytes_.starts_with(kByteOrderMark)) at_ = kByteOrderMark.size();
}

FileCursor::FileCursor(std::string file, int line, std::string bytes)
    : file_(std::move(file)), bytes_(std::move(bytes)), line_(line) {}

void FileCursor::fail(const std::string& message) const {
  fail_at(line_, message);
}

void FileCursor::fail_at(int line, const std::string& message) const {
  throw InputError({file_, line}, message);
}

std::string_view FileCursor::next_line(const char* what) {
  if (at_end()) fail(std::string("the file ends where ") + what + " should be; export it again");
  const std::size_t begin = at_;
  while (at_ < bytes_.size() && !is_line_end(bytes_[at_])) ++at_;
  const std::string_view line(bytes_.data() + begin, at_ - begin);
  skip_line_end();
  return line;
}

void FileCursor::set_comment(char first, std::function<void(std::string_view)> read) {
  comment_ = first;
  read_comment_ = std::move(read);
}

bool FileCursor::skip_blanks(char comment) {
  for (;;) {
    while (at_ < bytes_.size() && is_blank(bytes_[at_])) {
      if (is_line_end(bytes_[at_])) {
        skip_line_end();
      } else {
        ++at_;
      }
    }
    if (at_end()) return false;
    const bool is_comment = comment_ != 0 && bytes_[at_] == comment_;
    if (!is_comment && (comment == 0 || bytes_[at_] != comment)) return true;
    const std::string_view text = next_line("a comment");
    if (is_comment && read_comment_) read_comment_(text);
  }
}

bool FileCursor::skip_past_word(std::string_view word) {
  for (std::size_t found = bytes_.find(word, at_); found != std::string::npos;
       found = bytes_.find(word, found + 1)) {
    const std::size_t end = found + word.size();
    const bool is_word =
        (found == 0 || is_blank(bytes_[found - 1])) && (end == bytes_.size() || is_blank(bytes_[end]));
    if (!is_word) continue;
    while (at_ < found) {
      if (is_line_end(bytes_[at_])) {
        skip_line_end();
      } else {
        ++at_;
      }
    }
    at_ = end;
    return true;
  }
  return false;
}

std::string_view FileCursor::peek_word() {
  skip_blanks();
  std::size_t end = at_;
  while (end < bytes_.size() && !is_blank(bytes_[end])) ++end;
  return {bytes_.data() + at_, end - at_};
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
  if (!number) fail("'" + printable(word) + "' is no integer, where " + what + " should be; correct it");
  return *number;
}

double FileCursor::next_number(const char* what) {
  const std::string_view word = next_word(what);
  const std::optional<double> number = parse_number(word);
  if (!number) fail("'" + printable(word) + "' is no number, where " + what + " should be; correct it");
  return *number;
}

std::size_t FileCursor::next_count(const char* what, std::size_t least_bytes) {
  const int count = next_integer(what);
  if (count < 0) fail(std::string(what) + " is negative; export the file again");
  const auto size = static_cast<std::size_t>(count);
  if (least_bytes > 0 && size > num_left() / least_bytes)
    fail(std::string(what) + " is " + std::to_string(count) +
         ", more than the rest of the file holds; export it again");
  return size;
}

std::string_view FileCursor::next_bytes(std::size_t count, const char* what) {
  if (count > num_left())
    fail(std::string("the file ends within ") + what + "; copy or export it again, in binary");
  const std::string_view bytes(bytes_.data() + at_, count);
  at_ += count;
  return bytes;
}

void FileCursor::skip_line_end() {
  if (at_ < bytes_.size() && bytes_[at_] == '\r') {
    ++at_;
    if (at_ < bytes_.size() && bytes_[at_] == '\n') ++at_;
  } else if (at_ < bytes_.size() && bytes_[at_] == '\n') {
    ++at_;
  } else {
    return;
  }
  ++line_;
}

}  // namespace palpate
