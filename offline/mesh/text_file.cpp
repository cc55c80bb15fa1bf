#include "offline/mesh/text_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace palpate {
namespace {

std::string unreadable(int error) {
  return std::string("cannot be read (") + std::strerror(error) + "); check its name";
}

std::string read_open_file(int file, std::size_t max_bytes, std::string& content) {
  struct stat found {};
  if (fstat(file, &found) != 0) return unreadable(errno);
  if (S_ISDIR(found.st_mode)) return "is a folder; name a file";
  if (!S_ISREG(found.st_mode)) return "is no regular file (a pipe or a device); name a regular file";
  const std::string too_large =
      "is larger than " + std::to_string(max_bytes) + " bytes, the limit; name a smaller file";
  if (static_cast<std::size_t>(found.st_size) > max_bytes) return too_large;
  std::string text;
  text.reserve(static_cast<std::size_t>(found.st_size));  // a text that grows takes up to twice its size
  char block[1 << 16];
  for (;;) {
    const ssize_t count = read(file, block, sizeof block);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return unreadable(errno);
    if (count == 0) break;
    // Files in /proc state a size of 0, and a file may grow while it is read.
    if (static_cast<std::size_t>(count) > max_bytes - text.size()) return too_large;
    text.append(block, static_cast<std::size_t>(count));
  }
  content = std::move(text);
  return {};
}

}  // namespace

std::string read_text_file(const std::filesystem::path& file, std::string& content, std::size_t max_bytes) {
  // Without O_NONBLOCK the call waits at a pipe until somebody writes.
  const int opened = open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (opened < 0) return unreadable(errno);
  std::string complaint = read_open_file(opened, max_bytes, content);
  close(opened);
  return complaint;
}

}  // namespace palpate
