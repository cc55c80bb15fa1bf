#include "offline/mesh/text_file.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <system_error>
#include <utility>

namespace palpate {

std::string read_text_file(const std::filesystem::path& file, std::string& content) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error)) return "is a folder; name a file";
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream read;
  if (stream && stream.peek() != std::ifstream::traits_type::eof()) read << stream.rdbuf();
  if (!stream.is_open() || stream.bad() || read.bad()) {
    const std::string reason = errno != 0 ? std::strerror(errno) : "input error";
    return "cannot be read (" + reason + "); check its name";
  }
  content = std::move(read).str();
  return {};
}

}  // namespace palpate
