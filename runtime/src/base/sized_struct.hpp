// Structs that grow from release to release. `struct_size`, their first member, says how much of one the
// caller was compiled with, and what one side does not know has its default:
//   a smaller one than ours comes from an older caller, whose further members are not there;
//   a larger one from a newer caller, and will do while the members that we do not know are zero, which by rule
//   is their default.
#pragma once

#include <palpate/palpate.h>

#include <string.h>

namespace palpate {

// A struct_size above this was never written by anyone.
inline constexpr uint32_t kLargestStruct = 4096;

// Bytes of `from`, or 0 where its struct_size is none. `first_bytes`: size in the first release.
inline uint32_t known_size(uint32_t struct_size, uint32_t first_bytes) {
  return struct_size < first_bytes || struct_size > kLargestStruct ? 0 : struct_size;
}

// Writes what the caller knows of `from` over the defaults in `to`.
template <typename T>
pal_status read_sized(const T& from, uint32_t first_bytes, T& to) {
  const uint32_t bytes = known_size(from.struct_size, first_bytes);
  if (bytes == 0) return PAL_STATUS_BAD_STRUCT_SIZE;
  const unsigned char* begin = reinterpret_cast<const unsigned char*>(&from);
  for (uint32_t i = sizeof(T); i < bytes; ++i) {
    if (begin[i] != 0) return PAL_STATUS_BAD_STRUCT_SIZE;
  }
  memcpy(static_cast<void*>(&to), begin, bytes < sizeof(T) ? bytes : sizeof(T));
  to.struct_size = sizeof(T);
  return PAL_STATUS_OK;
}

// Fills as much of `to` as the caller knows, and sets the rest of it to zero.
template <typename T>
pal_status write_sized(const T& from, uint32_t first_bytes, T& to) {
  const uint32_t bytes = known_size(to.struct_size, first_bytes);
  if (bytes == 0) return PAL_STATUS_BAD_STRUCT_SIZE;
  unsigned char* begin = reinterpret_cast<unsigned char*>(&to);
  memcpy(begin, &from, bytes < sizeof(T) ? bytes : sizeof(T));
  if (bytes > sizeof(T)) memset(begin + sizeof(T), 0, bytes - sizeof(T));
  to.struct_size = bytes;
  return PAL_STATUS_OK;
}

}  // namespace palpate
