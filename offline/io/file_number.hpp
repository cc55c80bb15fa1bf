// Numbers of the types that mesh formats name, as text or as binary.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "offline/io/file_cursor.hpp"

namespace palpate {

// Far more components than an array for people has. Products with counts of points stay within 64 bits.
inline constexpr int kMaxComponents = 1 << 16;

// An unsigned type stands behind its signed type.
enum class NumberType : std::uint8_t {
  int8,
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64
};

enum class NumberCoding : std::uint8_t { text, little_endian, big_endian };

// Returns the type with this name in legacy VTK ("unsigned_char"), VTU ("UInt8") or PLY ("uchar") files.
// Capital letters do not matter.
std::optional<NumberType> number_type(std::string_view name);

// Returns the next word as a type.
NumberType next_type(FileCursor& cursor);

// Returns the size of a binary number.
std::size_t num_bytes(NumberType type);

// Returns the next number. Keeps infinity and NaN, which arrays may hold.
double next_number(FileCursor& cursor, NumberType type, NumberCoding coding, const char* what);

// Returns the next number; refuses fractions and numbers that an int does not hold.
int next_index(FileCursor& cursor, NumberType type, NumberCoding coding, const char* what);

// Fails if the rest of the file is too short for `count` numbers. Readers call it before they reserve memory.
void check_room(const FileCursor& cursor, std::size_t count, NumberType type, NumberCoding coding,
                const char* what);

}  // namespace palpate
