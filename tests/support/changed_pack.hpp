// A mutable copy of a pack, and the status of opening the copy.
#pragma once

#include <palpate/palpate.h>
#include <string.h>

#include "offline/pack/pack_writer.hpp"
#include "schemas/pack_checksum.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate::test {

inline AlignedBytes copy_of(std::span<const unsigned char> bytes) {
  AlignedBytes copy(bytes.size());
  memcpy(copy.bytes().data(), bytes.data(), bytes.size());
  return copy;
}

inline pack::PackHeader header_of(std::span<const unsigned char> bytes) {
  pack::PackHeader header;
  memcpy(&header, bytes.data(), sizeof header);
  return header;
}

inline void set_header(std::span<unsigned char> bytes, const pack::PackHeader& header) {
  memcpy(bytes.data(), &header, sizeof header);
}

// Recomputes the checksum, as a forger would.
inline void repair_checksum(std::span<unsigned char> bytes) {
  pack::PackHeader header = header_of(bytes);
  header.checksum = pack::checksum_of(bytes.data(), bytes.size());
  set_header(bytes, header);
}

inline pal_status open_status(std::span<const unsigned char> bytes) {
  alignas(16) unsigned char storage[PAL_PACK_STORAGE_BYTES];
  pal_pack* pack = nullptr;
  const pal_status status =
      pal_pack_open_memory(bytes.data(), bytes.size(), PAL_VERIFY_ONCE, storage, sizeof storage, &pack);
  pal_pack_close(pack);
  return status;
}

}  // namespace palpate::test
