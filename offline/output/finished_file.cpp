#include "offline/output/finished_file.hpp"

#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>

namespace palpate {
namespace {

namespace fs = std::filesystem;

// A device or a pipe, such as /dev/stdout: it is written into, for a rename would put a plain file in its
// place.
bool is_stream(const fs::path& path) {
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

// Where the file really lies: a link keeps pointing at it.
fs::path behind_links(const fs::path& path) {
  std::error_code error;
  if (!fs::is_symlink(path, error)) return path;
  fs::path target = fs::canonical(path, error);
  return error ? path : target;
}

// The process id keeps two programs that write the same result at once out of each other's temporary file.
fs::path temporary_beside(const fs::path& path) {
  fs::path temporary = path;
  temporary += ".unfinished-" + std::to_string(::getpid());
  return temporary;
}

}  // namespace

void check_can_finish(const fs::path& path) {
  const std::string name = path.string();
  if (fs::is_directory(path)) throw std::runtime_error(name + ": is a folder; name a file in it");
  if (path.has_parent_path() && !fs::is_directory(path.parent_path()))
    throw std::runtime_error(name + ": its folder does not exist; make it first");
  if (is_stream(path)) return;
  const fs::path temporary = temporary_beside(behind_links(path));
  errno = 0;
  const bool opened = std::ofstream(temporary).is_open();
  const int reason = errno;
  std::error_code ignored;
  fs::remove(temporary, ignored);
  if (!opened) {
    throw std::runtime_error(name + ": cannot be written (" + std::generic_category().message(reason) +
                             "); name another place");
  }
}

void check_keeps_inputs(const fs::path& path, const std::vector<fs::path>& inputs) {
  for (const fs::path& input : inputs) {
    std::error_code absent;
    if (fs::equivalent(path, input, absent))
      throw std::runtime_error(path.string() + ": is an input of this command; name another file with -o");
  }
}

void write_finished_file(const fs::path& path, const std::function<void(const fs::path&)>& write) {
  if (is_stream(path)) {
    write(path);
    return;
  }
  const fs::path place = behind_links(path);
  const fs::path temporary = temporary_beside(place);
  std::error_code ignored;
  try {
    write(temporary);
  } catch (...) {
    fs::remove(temporary, ignored);
    throw;
  }
  std::error_code error;
  fs::rename(temporary, place, error);
  if (error) {
    fs::remove(temporary, ignored);
    throw std::runtime_error(path.string() + ": " + error.message());
  }
}

void write_finished_bytes(const fs::path& path, std::span<const unsigned char> bytes) {
  write_finished_file(path, [&](const fs::path& temporary) {
    std::ofstream stream(temporary, std::ios::binary);
    stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    stream.close();
    if (!stream) throw std::runtime_error(path.string() + ": cannot be written");
  });
}

void write_finished_text(const fs::path& path, std::string_view text) {
  write_finished_bytes(path, {reinterpret_cast<const unsigned char*>(text.data()), text.size()});
}

}  // namespace palpate
