#include "offline/output/finished_file.hpp"

#include <unistd.h>

#include <stdexcept>
#include <string>
#include <system_error>

namespace palpate {

void write_finished_file(const std::filesystem::path& path,
                         const std::function<void(const std::filesystem::path&)>& write) {
  // The process id keeps two programs that write the same result at once out of each other's temporary file.
  std::filesystem::path temporary = path;
  temporary += ".unfinished-" + std::to_string(::getpid());
  std::error_code ignored;
  try {
    write(temporary);
  } catch (...) {
    std::filesystem::remove(temporary, ignored);
    throw;
  }
  std::error_code error;
  std::filesystem::rename(temporary, path, error);
  if (error) {
    std::filesystem::remove(temporary, ignored);
    throw std::runtime_error(path.string() + ": " + error.message());
  }
}

}  // namespace palpate
