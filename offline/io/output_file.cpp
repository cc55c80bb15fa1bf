#include "offline/io/output_file.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>

namespace palpate {

void write_output_file(const std::filesystem::path& file, std::string_view bytes) {
  std::ofstream stream(file, std::ios::binary | std::ios::trunc);
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  stream.close();
  if (!stream)
    throw std::runtime_error(file.string() + ": cannot be written (" + std::strerror(errno) +
                             "); check the folder and the space on the disk");
}

}  // namespace palpate
