// Structs that grow from release to release. The first member, `struct_size`, is the size that the caller was
// compiled with. A member that one side does not know has its default:
// - A smaller struct comes from an older caller, and lacks the newer members.
// - A larger struct comes from a newer caller. Its unknown members must be zero, their default by rule.
#pragma once

#include <palpate/palpate.h>

#include <string.h>

namespace palpate {

// No release has a struct_size above this.
inline constexpr uint32_t kLargestStruct = 4096;

// Returns struct_size, or 0 if it is invalid. `first_bytes`: size in the first release.
inline uint32_t valid_size(uint32_t struct_size, uint32_t first_bytes) {
  return struct_size < first_bytes || struct_size > kLargestStruct ? 0 : struct_size;
}

// Copies the caller's members in `from` over the defaults in `to`.
template <typename T>
pal_status read_sized(const T& from, uint32_t first_bytes, T& to) {
  const uint32_t bytes = valid_size(from.struct_size, first_bytes);
  if (bytes == 0) return PAL_STATUS_BAD_STRUCT_SIZE;
  const unsigned char* begin = reinterpret_cast<const unsigned char*>(&from);
  for (uint32_t i = sizeof(T); i < bytes; ++i) {
    if (begin[i] != 0) return PAL_STATUS_BAD_STRUCT_SIZE;
  }
  memcpy(static_cast<void*>(&to), begin, bytes < sizeof(T) ? bytes : sizeof(T));
  to.struct_size = sizeof(T);
  return PAL_STATUS_OK;
}

// Copies the members that both sides know to the caller's struct. The caller's other members become zero.
template <typename T>
pal_status write_sized(const T& from, uint32_t first_bytes, T& to) {
  const uint32_t bytes = valid_size(to.struct_size, first_bytes);
  if (bytes == 0) return PAL_STATUS_BAD_STRUCT_SIZE;
  unsigned char* begin = reinterpret_cast<unsigned char*>(&to);
  memcpy(begin, &from, bytes < sizeof(T) ? bytes : sizeof(T));
  if (bytes > sizeof(T)) memset(begin + sizeof(T), 0, bytes - sizeof(T));
  to.struct_size = bytes;
  return PAL_STATUS_OK;
}

}  // namespace palpate
