#include "offline/io/file_number.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>

#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

struct NamedType {
  std::string_view name;  // lower case
  NumberType type;
};

// "long" has eight bytes where VTK runs on Linux and macOS. VTK writes vtkIdType in four bytes.
constexpr auto kNamedTypes = std::to_array<NamedType>({
    {"int8", NumberType::int8},
    {"char", NumberType::int8},
    {"signed_char", NumberType::int8},
    {"vtktypeint8", NumberType::int8},
    {"uint8", NumberType::uint8},
    {"uchar", NumberType::uint8},
    {"unsigned_char", NumberType::uint8},
    {"vtktypeuint8", NumberType::uint8},
    {"int16", NumberType::int16},
    {"short", NumberType::int16},
    {"vtktypeint16", NumberType::int16},
    {"uint16", NumberType::uint16},
    {"ushort", NumberType::uint16},
    {"unsigned_short", NumberType::uint16},
    {"vtktypeuint16", NumberType::uint16},
    {"int32", NumberType::int32},
    {"int", NumberType::int32},
    {"vtkidtype", NumberType::int32},
    {"vtktypeint32", NumberType::int32},
    {"uint32", NumberType::uint32},
    {"uint", NumberType::uint32},
    {"unsigned_int", NumberType::uint32},
    {"vtktypeuint32", NumberType::uint32},
    {"int64", NumberType::int64},
    {"long", NumberType::int64},
    {"long_long", NumberType::int64},
    {"vtktypeint64", NumberType::int64},
    {"uint64", NumberType::uint64},
    {"unsigned_long", NumberType::uint64},
    {"unsigned_long_long", NumberType::uint64},
    {"vtktypeuint64", NumberType::uint64},
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
  cursor.fail("'" + printable(word) + "' is no number, where " + what + " should be; correct it");
}

}  // namespace

std::optional<NumberType> number_type(std::string_view name) {
  const auto lower = [](char letter) {
    return letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter;
  };
  for (const NamedType& known : kNamedTypes) {
    if (std::ranges::equal(known.name, name, {}, {}, lower)) return known.type;
  }
  return std::nullopt;
}

std::size_t num_bytes(NumberType type) {
  switch (type) {
    case NumberType::int8:
    case NumberType::uint8:
      return 1;
    case NumberType::int16:
    case NumberType::uint16:
      return 2;
    case NumberType::int32:
    case NumberType::uint32:
    case NumberType::float32:
      return 4;
    case NumberType::int64:
    case NumberType::uint64:
    case NumberType::float64:
      return 8;
  }
  return 8;
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
    cursor.fail(std::string("a number is no index, where ") + what +
                " should be; the file is damaged, export it again");
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

std::vector<double> next_numbers(FileCursor& cursor, std::size_t count, NumberType type, NumberCoding coding,
                                 const char* what) {
  check_room(cursor, count, type, coding, what);
  std::vector<double> numbers(count);
  for (double& number : numbers) number = next_number(cursor, type, coding, what);
  return numbers;
}

std::vector<int> next_indices(FileCursor& cursor, std::size_t count, NumberType type, NumberCoding coding,
                              const char* what) {
  check_room(cursor, count, type, coding, what);
  std::vector<int> numbers(count);
  for (int& number : numbers) number = next_index(cursor, type, coding, what);
  return numbers;
}

}  // namespace palpate
