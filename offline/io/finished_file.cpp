#include "offline/io/finished_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <csignal>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

namespace palpate {
namespace {

namespace fs = std::filesystem;

constexpr const char* kUnfinished = ".unfinished-";

// Whether `path` names a device or a pipe, which a rename would replace by a plain file.
bool is_stream(const fs::path& path) {
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

// A named pipe without a reader would block the program. A pipe of the shell, as >(sort), is a link in /dev/fd.
void refuse_named_pipe(const fs::path& path) {
  std::error_code ignored;
  if (fs::is_fifo(fs::symlink_status(path, ignored)))
    throw std::runtime_error(path.string() + ": is a named pipe; name a file");
}

// Returns the file behind a link, so that a rename keeps the link; else returns `path`.
fs::path behind_links(const fs::path& path) {
  std::error_code error;
  if (!fs::is_symlink(path, error)) return path;
  fs::path target = fs::canonical(path, error);
  return error ? path : target;
}

// The process id separates temporary files of concurrent programs.
fs::path temporary_beside(const fs::path& path) {
  fs::path temporary = path;
  temporary += kUnfinished + std::to_string(::getpid());
  return temporary;
}

// Creates the empty temporary file; returns 0 or errno. O_EXCL refuses a link that another user has placed.
int create_temporary(const fs::path& temporary) {
  std::error_code ignored;
  fs::remove(temporary, ignored);
  const int file = ::open(temporary.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666);
  if (file < 0) return errno;
  ::close(file);
  return 0;
}

void remove_left_overs(const fs::path& path) {
  const std::string prefix = path.filename().string() + kUnfinished;
  std::error_code ignored;
  std::vector<fs::path> left_over;
  for (fs::directory_iterator entry(path.has_parent_path() ? path.parent_path() : ".", ignored), end;
       entry != end; entry.increment(ignored)) {
    const std::string name = entry->path().filename().string();
    if (!name.starts_with(prefix)) continue;
    const std::string digits = name.substr(prefix.size());
    pid_t process = 0;
    const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), process);
    // kill(process, 0) tests for the process; ESRCH means no such process.
    const bool is_number = read.ec == std::errc() && read.ptr == digits.data() + digits.size() && process > 0;
    if (is_number && ::kill(process, 0) != 0 && errno == ESRCH) left_over.push_back(entry->path());
  }
  for (const fs::path& file : left_over) fs::remove(file, ignored);
}

}  // namespace

void check_can_finish(const fs::path& path) {
  const std::string name = path.string();
  if (fs::is_directory(path)) throw std::runtime_error(name + ": is a folder; name a file in it");
  if (path.has_parent_path() && !fs::is_directory(path.parent_path()))
    throw std::runtime_error(name + ": its folder does not exist; make it first");
  refuse_named_pipe(path);
  if (is_stream(path)) return;
  remove_left_overs(behind_links(path));
  const fs::path temporary = temporary_beside(behind_links(path));
  const int reason = create_temporary(temporary);
  std::error_code ignored;
  fs::remove(temporary, ignored);
  if (reason != 0) {
    throw std::runtime_error(name + ": cannot be written (" + std::generic_category().message(reason) +
                             "); name another place");
  }
}

void check_keeps_inputs(const fs::path& path, const std::vector<fs::path>& inputs) {
  for (const fs::path& input : inputs) {
    std::error_code absent;
    if (fs::equivalent(path, input, absent))
      throw std::runtime_error(path.string() + ": is an input of this command; name another place with -o");
  }
}

void check_replaces(const fs::path& path, std::string_view beginning, const char* kind) {
  std::error_code absent;
  if (!fs::is_regular_file(path, absent)) return;
  std::string present(beginning.size(), '\0');
  std::ifstream stream(path, std::ios::binary);
  stream.read(present.data(), static_cast<std::streamsize>(present.size()));
  if (stream.gcount() > 0 && present != beginning)
    throw std::runtime_error(path.string() + ": exists, and is not " + kind +
                             "; remove it, or name another place");
}

void write_finished_file(const fs::path& path, const std::function<void(const fs::path&)>& write) {
  refuse_named_pipe(path);
  if (is_stream(path)) {
    write(path);
    return;
  }
  const fs::path place = behind_links(path);
  const fs::path temporary = temporary_beside(place);
  if (const int reason = create_temporary(temporary); reason != 0) {
    throw std::runtime_error(path.string() + ": cannot be written (" +
                             std::generic_category().message(reason) + "); name another place");
  }
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
    errno = 0;
    std::ofstream stream(temporary, std::ios::binary);
    stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    stream.close();
    if (!stream) {
      const std::string reason = errno != 0 ? " (" + std::generic_category().message(errno) + ")" : "";
      throw std::runtime_error(path.string() + ": cannot be written" + reason +
                               "; make room, or name another place");
    }
  });
}

void write_finished_text(const fs::path& path, std::string_view text) {
  write_finished_bytes(path, {reinterpret_cast<const unsigned char*>(text.data()), text.size()});
}

}  // namespace palpate
