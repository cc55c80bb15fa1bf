#include "offline/io/file_number.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>

#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

struct NamedType {
  std::string_view name;
  NumberType type;
};

// "long" has eight bytes where VTK runs on Linux and macOS. VTK writes vtkIdType in four bytes.
constexpr auto kSignedTypes = std::to_array<NamedType>({
    {"int8", NumberType::int8},
    {"char", NumberType::int8},
    {"signed_char", NumberType::int8},
    {"int16", NumberType::int16},
    {"short", NumberType::int16},
    {"int32", NumberType::int32},
    {"int", NumberType::int32},
    {"vtkidtype", NumberType::int32},
    {"int64", NumberType::int64},
    {"long", NumberType::int64},
    {"long_long", NumberType::int64},
});

constexpr auto kRealTypes = std::to_array<NamedType>({
    {"float32", NumberType::float32},
    {"float", NumberType::float32},
    {"float64", NumberType::float64},
    {"double", NumberType::float64},
});

double next_text_number(FileCursor& cursor, const char* what) {
  const std::string_view word = cursor.next_word(what);
  if (const std::optional<double> number = parse_number(word)) return *number;
  const std::string copy(word.substr(0, 16));  // long enough for "-infinity"
  char* end = nullptr;
  const double number = std::strtod(copy.c_str(), &end);
  if (end != copy.c_str() && *end == 0 && word.size() == copy.size() && !std::isfinite(number)) return number;
  cursor.fail_number(word, false, what);
}

}  // namespace

std::optional<NumberType> number_type(std::string_view name) {
  const std::string lower = lower_case(name);
  std::string_view word = lower;
  if (word.starts_with("vtktype")) word.remove_prefix(std::string_view("vtktype").size());
  for (const NamedType& known : kRealTypes) {
    if (known.name == word) return known.type;
  }
  const bool is_unsigned = word.starts_with('u');
  if (is_unsigned)
    word.remove_prefix(word.starts_with("unsigned_") ? std::string_view("unsigned_").size() : 1);
  for (const NamedType& known : kSignedTypes) {
    if (known.name == word)
      return static_cast<NumberType>(static_cast<int>(known.type) + (is_unsigned ? 1 : 0));
  }
  return std::nullopt;
}

NumberType next_type(FileCursor& cursor) {
  const std::string_view word = cursor.next_word("a type of numbers");
  const std::optional<NumberType> type = number_type(word);
  if (!type) cursor.fail("'" + printable(word) + "' is no type of numbers; write int, float or double");
  return *type;
}

std::size_t num_bytes(NumberType type) {
  if (type == NumberType::float32) return 4;
  if (type == NumberType::float64) return 8;
  return std::size_t{1} << (static_cast<int>(type) / 2);
}

double next_number(FileCursor& cursor, NumberType type, NumberCoding coding, const char* what) {
  if (coding == NumberCoding::text) return next_text_number(cursor, what);
  const bool is_big = coding == NumberCoding::big_endian;
  switch (type) {
    case NumberType::int8:
      return cursor.next_binary<std::int8_t>(is_big, what);
    case NumberType::uint8:
      return cursor.next_binary<std::uint8_t>(is_big, what);
    case NumberType::int16:
      return cursor.next_binary<std::int16_t>(is_big, what);
    case NumberType::uint16:
      return cursor.next_binary<std::uint16_t>(is_big, what);
    case NumberType::int32:
      return cursor.next_binary<std::int32_t>(is_big, what);
    case NumberType::uint32:
      return cursor.next_binary<std::uint32_t>(is_big, what);
    case NumberType::int64:
      return static_cast<double>(cursor.next_binary<std::int64_t>(is_big, what));
    case NumberType::uint64:
      return static_cast<double>(cursor.next_binary<std::uint64_t>(is_big, what));
    case NumberType::float32:
      return static_cast<double>(cursor.next_binary<float>(is_big, what));
    case NumberType::float64:
      return cursor.next_binary<double>(is_big, what);
  }
  return 0;
}

int next_index(FileCursor& cursor, NumberType type, NumberCoding coding, const char* what) {
  if (coding == NumberCoding::text) return cursor.next_integer(what);
  const double number = next_number(cursor, type, coding, what);
  constexpr double kSmallest = std::numeric_limits<int>::min(), kLargest = std::numeric_limits<int>::max();
  if (!(number >= kSmallest && number <= kLargest) || number != std::floor(number))
    cursor.fail_number(fmt::format("{}", number), true, what);
  return static_cast<int>(number);
}

void check_room(const FileCursor& cursor, std::size_t count, NumberType type, NumberCoding coding,
                const char* what) {
  // A number in text takes a digit and a blank, the last one a digit.
  const bool is_text = coding == NumberCoding::text;
  const std::size_t most = is_text ? (cursor.num_left() + 1) / 2 : cursor.num_left() / num_bytes(type);
  if (count > most)
    cursor.fail("the file is too short for the " + std::to_string(count) + " numbers of " + what +
                "; copy or export it again");
}

}  // namespace palpate
