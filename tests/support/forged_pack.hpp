// Changes the content of a pack file and repairs the checksum, so that only checks of content can notice.
#pragma once

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "schemas/pack_checksum.hpp"
#include "schemas/pack_generated.h"
#include "schemas/pack_layout.hpp"
#include "tests/support/run_program.hpp"

namespace palpate::test {

// `change` receives the tables and a pointer to the file's first byte, the origin of segment offsets.
inline void forge_bytes(const std::filesystem::path& pack,
                        const std::function<void(pack::Pack&, unsigned char*)>& change) {
  std::string bytes = file_text(pack);
  auto* data = reinterpret_cast<unsigned char*>(bytes.data());
  change(*flatbuffers::GetMutableRoot<pack::Pack>(data + sizeof(pack::PackHeader)), data);
  pack::PackHeader header;
  std::memcpy(&header, data, sizeof header);
  header.checksum = pack::checksum_of(data, bytes.size());
  std::memcpy(data, &header, sizeof header);
  std::ofstream(pack, std::ios::binary) << bytes;
}

inline void forge(const std::filesystem::path& pack, const std::function<void(pack::Pack&)>& change) {
  forge_bytes(pack, [&](pack::Pack& tables, unsigned char*) { change(tables); });
}

}  // namespace palpate::test
